"""The gallery: a page for every bundled model with its text, in docs/gallery; the site adds sketches and motions."""

from __future__ import annotations

import html
import os
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import lag2fmu
from lag2fmu.fmu.picture import picture_of
from lag2fmu.formats.write import write
from lag2fmu.resources import bundled

OVERVIEW = "gallery/index.md"
INTRODUCTION = """# Gallery

Every mechanism here comes with lag2fmu. Its name is all that a command needs: `lag2fmu simulate NAME --animate
NAME.gif` shows it moving, `lag2fmu show NAME` derives its equations, `lag2fmu export NAME` writes its FMU. A test
compares each FMU with the direct integration of the mechanism, and most with a closed form from the literature.

"""


def texts() -> dict[str, str]:
    """Path below docs/ -> Markdown: the overview as a table, and a page for each model."""
    found = {f"gallery/{name}.md": _page(name) for name in bundled()}
    rows = (f"| [{name}]({name}.md) | {lag2fmu.load(name).title} |\n" for name in bundled())
    return found | {OVERVIEW: f"{INTRODUCTION}| name | mechanism |\n|---|---|\n{''.join(rows)}"}


def _page(name: str) -> str:
    m = lag2fmu.load(name)
    source = f"Source: {html.escape(m.source, quote=False)}.\n\n" if m.source else ""
    return f"""# {m.title}

{source}```sh
lag2fmu show {name}                                # its equations of motion
lag2fmu simulate {name} --animate {name}.gif
lag2fmu export {name}
```

The mechanism as text, as `lag2fmu show {name} --format toml` prints it:

```toml
{write(m)}```
"""


def with_picture(path: str, markdown: str, moving: Sequence[str]) -> str:
    """The page ``path`` as the site shows it: the overview with cards, a page with a sketch or a motion."""
    if path == OVERVIEW:
        return f'{INTRODUCTION}<div class="models">\n' + "\n".join(map(_card, bundled())) + "\n</div>\n"
    name = Path(path).stem
    title, rest = markdown.split("\n", 1)
    if name in moving:
        picture = f'<iframe class="live" src="live/{name}.html" title="{html.escape(title[2:])}, moving"></iframe>'
    else:
        picture = f'<div class="sketch">{_picture(name)}</div>' if _picture(name) else ""
    return f"{title}\n\n{picture}\n{rest}"


def _card(name: str) -> str:
    title = html.escape(lag2fmu.load(name).title)
    return f'<a class="model" href="{name}.html">{_picture(name)}<span>{title}</span><code>{name}</code></a>'


@cache
def _picture(name: str) -> str:
    return picture_of(lag2fmu.load(name))


def motions(names: Sequence[str]) -> dict[str, str]:
    """Path in the site -> live page of each of ``names``, which compares itself with a direct integration."""
    with TemporaryDirectory(prefix="lag2fmu-") as folder, ThreadPoolExecutor(os.cpu_count()) as pool:
        pages = pool.map(lambda name: _moving_page(name, Path(folder, f"{name}.html")), names)
        return {f"gallery/live/{name}.html": page for name, page in zip(names, pages, strict=True)}


def _moving_page(name: str, path: Path) -> str:
    """Made by a process of its own."""
    subprocess.run([sys.executable, "-m", "lag2fmu", "page", name, "-o", str(path)], check=True)
    return path.read_text("utf-8")
