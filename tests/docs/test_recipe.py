"""docs/recipe.yaml, the recipe for conda, asks for what pyproject.toml asks for."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from lag2fmu.version import VERSION

RECIPE = Path(__file__).parents[2] / "docs" / "recipe.yaml"


def listed(section: str) -> set[str]:
    """The entries of a list in the recipe, as NAME>=VERSION."""
    found = re.search(rf"^ +{section}:\n((?: +- .*\n)+)", RECIPE.read_text("utf-8"), re.MULTILINE)
    assert found is not None
    return {line.strip(" -").replace(" ", "") for line in found[1].splitlines()}


def test_the_recipe_has_the_version_and_the_dependencies_of_the_package() -> None:
    text = (RECIPE.parents[1] / "pyproject.toml").read_text("utf-8")
    python = re.search(r'requires-python = "(.*)"', text)
    build = re.search(r'requires = \["(.*)"\]', text)
    needed = re.search(r"^dependencies = \[\n(.*?)^\]", text, re.MULTILINE | re.DOTALL)
    assert python is not None
    assert build is not None
    assert needed is not None
    run = {one.partition(";")[0] for one in re.findall(r'^ *"(.*?)"', needed[1], re.MULTILINE)}
    assert listed("run") == {f"python{python[1]}", *run}
    assert listed("host") == {f"python{python[1]}", "pip", build[1]}
    assert f"version: {VERSION}\n" in RECIPE.read_text("utf-8")


def test_the_recipe_is_one() -> None:
    rattler_build = pytest.importorskip("rattler_build", reason="pip install py-rattler-build")
    recipe = rattler_build.Stage0Recipe.from_file(RECIPE)
    (variant,) = recipe.render(rattler_build.VariantConfig())
    assert variant.recipe.package.name == "lag2fmu"
