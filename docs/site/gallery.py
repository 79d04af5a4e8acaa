"""The gallery: a card for every bundled model, and a page with its sketch, its text and, where chosen, its motion."""

from __future__ import annotations

import html
import os
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

import lag2fmu
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.fmu.picture import picture_of
from lag2fmu.formats.write import write
from lag2fmu.resources import bundled

INTRODUCTION = """---
hide: [navigation, toc]
---

# Gallery

Every mechanism here comes with lag2fmu. Its name is all that a command needs: `lag2fmu simulate NAME --animate
NAME.gif` shows it moving, `lag2fmu show NAME` derives its equations, `lag2fmu export NAME` writes its FMU. A test
compares each FMU with the direct integration of the mechanism, and most with a closed form from the literature.
"""


def pages(live: str) -> dict[str, str]:
    """Path in the site -> content: the overview, a page for each model, live pages for those that ``live`` names."""
    names = bundled() if live == "all" else () if live == "none" else tuple(live.split(","))
    with TemporaryDirectory(prefix="lag2fmu-") as folder, ThreadPoolExecutor(os.cpu_count()) as pool:
        moving = pool.map(lambda name: _moving_page(name, Path(folder, f"{name}.html")), names)
        found = _sketches(names)
        return found | {f"gallery/live/{name}.html": page for name, page in zip(names, moving, strict=True)}


def _moving_page(name: str, path: Path) -> str:
    """The live page of a model, which compares itself with a direct integration; made by a process of its own."""
    subprocess.run([sys.executable, "-m", "lag2fmu", "page", name, "-o", str(path)], check=True)
    return path.read_text("utf-8")


def _sketches(moving: Sequence[str]) -> dict[str, str]:
    """The overview and the page of each model; those of ``moving`` frame the live page."""
    found, cards = {}, []
    for name in bundled():
        equations = lag2fmu.derive(name)
        picture = picture_of(equations.mechanism)
        title = html.escape(equations.mechanism.title)
        cards.append(f'<a class="model" href="{name}.html">{picture}<span>{title}</span><code>{name}</code></a>')
        found[f"gallery/{name}.md"] = _page(equations, picture, name in moving)
    found["gallery/index.md"] = f'{INTRODUCTION}\n<div class="models">\n' + "\n".join(cards) + "\n</div>\n"
    return found


def _page(equations: EquationsOfMotion, picture: str, live: bool) -> str:
    m = equations.mechanism
    moving = f'<iframe class="live" src="live/{m.name}.html" title="{html.escape(m.title)}, moving"></iframe>\n\n'
    return f"""---
hide: [navigation, toc]
---

# {m.title}

{moving if live else f'<div class="sketch">{picture}</div>' if picture else ""}

{f"Source: {html.escape(m.source)}." if m.source else ""}

```sh
lag2fmu show {m.name}                                # its equations of motion
lag2fmu simulate {m.name} --animate {m.name}.gif
lag2fmu export {m.name}
```

The mechanism as text, as `lag2fmu show {m.name} --format toml` prints it:

```toml
{write(lag2fmu.load(m.name))}```
"""
