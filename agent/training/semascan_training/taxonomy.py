"""Class names and colours, the same as the agent's (`shared/model/src/taxonomy.rs`): a colour is a class everywhere."""

from dataclasses import dataclass

# Told apart by people with colour-vision deficiency (after Okabe and Ito).
PALETTE = (
    "#3b82c4", "#e69f00", "#2a9d76", "#d55e3a", "#b66db0", "#56b4e9",
    "#c9b82f", "#7a5cc7", "#8aa83a", "#e07b9a", "#4f8a8b", "#a6764a",
)  # fmt: skip
NONE_COLOUR = "#8c939c"
FIRST_DEFECT = 6  # defects begin in the middle of the palette, so that they differ from the components

# Of the virtual cell, whose starter motors the recipes are trained on.
COMPONENTS = ("none", "housing", "solenoid", "carrier", "gear", "electrical connection")
DEFECTS = ("none", "corrosion", "wear", "crack")


@dataclass(frozen=True)
class ClassDef:
    """One class: its name as people read it and its sRGB colour."""

    name: str
    colour: str


def class_list(names: list[str], defects: bool = False) -> list[ClassDef]:
    """Classes from their names; the first name must be `none`."""
    first = FIRST_DEFECT if defects else 0
    coloured = [ClassDef(name, PALETTE[(first + i) % len(PALETTE)]) for i, name in enumerate(names[1:])]
    return [ClassDef("none", NONE_COLOUR), *coloured]
