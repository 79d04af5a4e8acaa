"""FMUs for WebAssembly by the draft layered standard fmi-ls-wasm: its interfaces, and components that have them."""
