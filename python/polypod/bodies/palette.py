"""Colours of all figures, pages and models: one palette, a colour for each leg."""

BLUE, ORANGE, GREEN, VERMILION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY, BLACK, YELLOW = "#CC79A7", "#56B4E9", "#000000", "#F0E442"
PALETTE = (BLUE, ORANGE, GREEN, VERMILION, PURPLE, SKY, BLACK)
"""Colours that colour-blind readers can tell apart (Okabe and Ito, Color Universal Design, 2008)."""

INK, GREY, PALE = "#262626", "#7A7A7A", "#E4E6E9"


Rgb = tuple[int, int, int]


def rgb(color: str) -> Rgb:
    """Red, green, blue from 0 to 255 of a colour such as #C9CDD3."""
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)


def color_of(index: int) -> str:
    """The colour of leg (or curve) number `index`, from 0, the same in every figure."""
    return PALETTE[index % len(PALETTE)]
