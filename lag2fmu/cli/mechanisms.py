"""The commands about mechanisms: models, new, show."""

from __future__ import annotations

from pathlib import Path

import click

from lag2fmu.cli.options import SET, check_picture, load_mechanism
from lag2fmu.cli.terminal import console
from lag2fmu.errors import ExportError


@click.command()
def models() -> None:
    """List the mechanisms that come with lag2fmu."""
    from rich.table import Table

    from lag2fmu.resources import bundled, summary

    table = Table(box=None, pad_edge=False)
    for heading in ("model", "what it is"):
        table.add_column(heading)
    for name, path in bundled().items():
        table.add_row(name, summary(path))
    console().print(table)


@click.command()
@click.argument("name")
def new(name: str) -> None:
    """Write NAME.toml, a commented mechanism to start from, and the schema with which editors check it."""
    from lag2fmu.formats.starting import write_start

    path, schema = write_start(name, Path())
    click.echo(f"wrote {path}, a cart with a pole to start from: try 'lag2fmu validate {path}'")
    click.echo(f"{schema} beside it lets editors complete and check the file (Even Better TOML, Taplo)")


@click.command()
@click.argument("model")
@click.option("--format", "style", type=click.Choice(["text", "latex", "toml"]), default="text", show_default=True)
@click.option(
    "--plot", type=click.Path(path_type=Path), help="Draw the mechanism and its normal modes (.png, .svg, .pdf)."
)
@click.option("--analysis", is_flag=True, help="Conserved quantities, equilibria, modes and more, after the steps.")
@click.option("--full", is_flag=True, help="Write long formulas to their end.")
@SET
def show(model: str, style: str, plot: Path | None, analysis: bool, full: bool, settings: tuple[str, ...]) -> None:
    """Walk the twelve steps of the textbook procedure, or write the mechanism as text (toml)."""
    from lag2fmu.explain.procedure import procedure
    from lag2fmu.formats.write import write

    if analysis and style == "toml":
        raise ExportError("--analysis is written as text or LaTeX; leave out '--format toml'")
    check_picture(plot)
    mechanism = load_mechanism(model, settings)
    click.echo(write(mechanism) if style == "toml" else procedure(mechanism, style, full=full), nl=False)
    if analysis:
        from lag2fmu.analysis.report import analysis_report

        click.echo(analysis_report(mechanism, style), nl=False)
    if plot is not None:
        from lag2fmu.verify.plots.figures import save
        from lag2fmu.verify.plots.mechanism import mechanism_figure

        save(mechanism_figure(mechanism), plot)
