"""The numbers printed in the paper, as text, each with its place: data, never used to tune anything."""

from __future__ import annotations

import math
from typing import NamedTuple


class Printed(NamedTuple):
    """A number as printed: ``text`` keeps its digits, ``place`` says where it stands.

    ``read_to``: how finely it could be read, where that is coarser than its digits.
    """

    text: str
    unit: str
    place: str
    read_to: float = 0.0

    @property
    def value(self) -> float:
        """The number."""
        return float(self.text)

    @property
    def rounding(self) -> float:
        """Half a unit of the last printed digit."""
        return 0.5 * 10.0 ** -len(self.text.partition(".")[2])

    @property
    def resolution(self) -> float:
        """The coarser of its rounding and of what it was read off."""
        return max(self.rounding, self.read_to)

    def __str__(self) -> str:
        return f"{self.text} {self.unit}".rstrip()


#: Half the distance of two lines (Hz) of the DFT of Fig. 5. The printed 0.732 Hz is the 15th line of 2048 samples at
#: 100 Hz; with more samples another line would be nearer to sqrt(2k/m).
_HALF_LINE = 0.5 * 100 / 2048


# Parameters of the figures (captions and Section 4), with Table 1 for the rest.
FIGURE_9 = {"rho": 0.14, "g": 0.02}
FIGURE_10 = {"rho": 0.16, "g": 0.0145}
FIGURE_11 = {"omega": 3.69, "g": -0.0045}
FIGURE_12 = {0.29: 2, 0.39: 2, 0.42: 1, 0.46: 1}  # rho -> period number, by the ranges printed for Fig. 11
FIGURE_13 = {"omega": 11.15, "rho": 0.33}
FIGURE_14 = {-0.0012: 1, 0.0009: 2, 0.0014: 3, 0.0018: 0}  # g of the caption -> period number (0: chaotic)
FIGURE_14_TEXT = {-0.0012: 1, 0.005: 2, 0.0012: 3, 0.0014: 0}  # g as the text of Section 4 prints them
FIGURE_17 = {"rho": 0.23, "g": 0.0036}
FIGURE_17_TEXT = {8.64: "periodic, no contact", 9.55: "chaotic", 9.88: "periodic, with contact"}  # omega
FIGURE_18 = {8.64: 1, 9.55: 0, 9.88: 1}  # omega -> period number (0: chaotic)

# Parameters as identified in Section 3.1.
_T = "Table 1"
TABLE_1 = {
    "k": Printed("8.47", "N/m", f"Fig. 4, {_T}"),
    "k_s": Printed("1210", "N/m", f"Fig. 4, {_T}"),
    "c": Printed("0.87", "N s/m", f"Fig. 6, {_T}"),
    "c_s": Printed("0.60", "N s/m", f"Fig. 7, {_T}"),
    "m": Printed("0.838", "kg", f"Section 3.1, {_T}"),
    "omega_0": Printed("4.60", "rad/s", f"Fig. 5, {_T}", read_to=2 * math.pi * _HALF_LINE),
}
TEST_MASS = 1.33  # kg, Fig. 7
#: sqrt(2k/m) of Table 1 (rad/s); the table prints 4.60 beside it.
NATURAL_FREQUENCY = math.sqrt(2 * TABLE_1["k"].value / TABLE_1["m"].value)

_9, _11 = "Section 4, on Fig. 9", "Section 4, on Fig. 11"
NUMBERS = {
    "natural frequency": Printed("4.50", "rad/s", "Section 3.1"),
    "peak of the DFT": Printed("0.732", "Hz", "Fig. 5", read_to=_HALF_LINE),
    "damping ratio": Printed("0.115", "", "Fig. 6"),
    "damping ratio of the support": Printed("0.0075", "", "Fig. 7"),
    "period 2 near": Printed("3.63", "rad/s", _9),
    "jump rising": Printed("5.88", "rad/s", _9),
    "jump falling": Printed("5.29", "rad/s", _9),
    "period 1 from": Printed("0.406", "N", _11),
    "period 2 from": Printed("0.28", "N", _11),
    "period 4 from": Printed("0.26", "N", _11),
}
