"""Recipes: every one that is shipped is read, wrong ones are refused by field."""

import pytest
from conftest import RECIPES

from semascan_training.errors import TrainingError
from semascan_training.recipe import read_recipe


def test_every_recipe_is_read_and_named_as_its_file():
    paths = sorted(RECIPES.glob("*.toml"))
    assert len(paths) > 15
    for path in paths:
        assert read_recipe(path).name == path.stem


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ('name = "a"\ntask = "semantic"', "network"),
        ('name = "a"\ntask = "semantic"\n[network]\narchitecture = 3', "network.architecture"),
        ('name = "a"\ntask = "guess"\n[network]\narchitecture = "u-net"', "task"),
        ('name = "a"\ntask = "semantic"\nsize = 1\n[network]\narchitecture = "u-net"', "size"),
        ('name = "a"\ntask = "semantic"\n[network]\narchitecture = "u-net"\n[training]\nbatch = 0', "training.batch"),
        ('name = "a"\ntask = "semantic"\n[network]\narchitecture = "u-net"\nfusion = "early"', "network.fusion"),
    ],
)
def test_wrong_recipes_name_the_field(tmp_path, text, field):
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    with pytest.raises(TrainingError, match=field):
        read_recipe(path)
