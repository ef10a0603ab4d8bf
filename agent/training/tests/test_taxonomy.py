"""Classes and their colours."""

import re
from pathlib import Path

from semascan_training.taxonomy import COMPONENTS, DEFECTS, NONE_COLOUR, PALETTE, class_list

AGENT = Path(__file__).parents[3] / "shared" / "model" / "src" / "taxonomy.rs"


def test_colours_are_the_agents():
    text = AGENT.read_text(encoding="utf-8")
    palette = text[text.index("const PALETTE") : text.index("];", text.index("const PALETTE"))]
    found = ["#" + "".join(triple) for triple in re.findall(r"\[0x(\w\w), 0x(\w\w), 0x(\w\w)\]", palette)]
    assert tuple(found) == PALETTE
    none = re.search(r"NONE_COLOR: Color = \[0x(\w\w), 0x(\w\w), 0x(\w\w)\]", text)
    assert "#" + "".join(none.groups()) == NONE_COLOUR


def test_components_and_defects_share_no_colour():
    components, defects = class_list(COMPONENTS), class_list(DEFECTS, defects=True)
    assert components[0].colour == defects[0].colour == NONE_COLOUR
    assert not {c.colour for c in components[1:]} & {d.colour for d in defects[1:]}
