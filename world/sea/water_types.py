"""Kinds of sea water by how clear they are: Jerlov's optical types."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

KOSCHMIEDER_CONSTANT = 3.912  # -ln 0.02: visibility is the distance at which 2 % of the contrast is left (Koschmieder)
WATER_TYPES = ("I", "IA", "IB", "II", "III", "1C", "3C", "5C", "7C", "9C")
# Absorption a, scattering b and diffuse attenuation Kd of daylight, 1/m, at these wavelengths: Solonenko and Mobley,
# "Inherent optical properties of Jerlov water types", Applied Optics 54 (2015) 5392. Theirs of 5C from 600 nm on are
# misprints: here a is Williamson and Hollins' (Applied Optics 61 (2022) 9951), b of the authors' own formula, Kd the
# mean of 3C and 7C. The two papers' b differ by a factor of up to four.
TABLE = """
nm        425     450     475     500     525     550     575     600     625     650
I   a      .017    .018    .019    .026    .046    .062    .082    .228    .295    .334
I   b    .00482  .00381  .00306  .00249  .00205   .0017  .00143  .00122  .00104 .000899
I   Kd     .022    .022    .021    .029    .049    .065    .085    .233    .302    .341
IA  a     .0225   .0221   .0216   .0282   .0468   .0622   .0821    .228    .295    .334
IA  b    .00755  .00631  .00536  .00461  .00402  .00354  .00315  .00283  .00256  .00234
IA  Kd    .0274   .0264   .0253   .0316   .0503   .0658   .0858    .234    .303    .342
IB  a     .0246   .0235   .0225   .0287   .0469   .0623   .0822    .228    .296    .334
IB  b     .0732    .068   .0635   .0597   .0565   .0536   .0511   .0488   .0468    .045
IB  Kd     .036   .0342   .0325   .0386   .0572   .0726   .0926    .241     .31    .349
II  a     .0257   .0241   .0228   .0288   .0469   .0622   .0821    .228    .296    .334
II  b      .555    .504    .459    .421    .387    .358    .332    .309    .288     .27
II  Kd    .0671    .062   .0579   .0641   .0845   .0999     .12     .27    .337    .375
III a     .0449   .0388   .0335   .0358   .0507   .0646   .0838    .229    .297    .336
III b      1.52    1.38    1.26    1.15    1.06     .98    .908    .845    .788    .737
III Kd      .14    .124     .11    .109    .129    .144    .164    .324     .39    .426
1C  a      .147    .105    .077    .064    .068    .076    .092    .236    .304    .344
1C  b      .567    .514    .469    .429    .395    .365    .338    .314    .293    .274
1C  Kd     .236    .179    .139     .12    .121    .129    .146    .317    .395    .439
3C  a      .236    .154    .105    .081    .078    .082    .095    .239    .307    .346
3C  b      1.65     1.5    1.36    1.25    1.15    1.06    .985    .916    .855      .8
3C  Kd     .439    .319     .24    .197    .187    .187    .201     .38    .456    .498
5C  a      .437    .297    .204    .151    .127    .117    .119    .259    .327    .367
5C  b      2.06    1.87    1.71    1.56    1.44    1.33    1.23    1.15    1.07       1
5C  Kd     .729    .535    .401    .319    .277    .255    .252    .453    .528    .567
7C  a      .753    .542    .388     .29    .233    .195    .175    .301    .367    .403
7C  b      3.63     3.3    3.01    2.76    2.54    2.35    2.18    2.03    1.89    1.77
7C  Kd     1.21    .924     .71     .56     .47    .409    .371    .527      .6    .635
9C  a      1.24    .943    .709    .543     .43    .348    .291     .39    .436    .456
9C  b      4.84    4.39    4.01    3.67    3.38    3.12    2.89    2.69    2.51    2.35
9C  Kd     1.97    1.56    1.24       1    .826    .696    .603     .72    .763    .775
"""
PARTICLES_BACK = 0.0183  # share of what particles scatter that goes backwards: Petzold 1972, as used by Mobley 1994
MOLECULES = 0.00193  # 1/m, scattering of pure sea water at 550 nm, half of it backwards: Morel 1974
CAMERA = ((610.0, 30.0), (540.0, 30.0), (465.0, 30.0))  # nm, peak and standard deviation of red, green and blue


class WaterColors(NamedTuple):
    """Optical properties of water in a camera, for red, green, blue (3,): coefficients in 1/m, and a share of white.

    `direct` attenuates what is seen, `veil` fills in the light of the water, `daylight` goes down with depth; `glow` is
    the light of deep water, seen straight down.
    """

    direct: Floats
    veil: Floats
    daylight: Floats
    glow: Floats


def jerlov_colors(kind: str) -> WaterColors:
    """The colors of a type of Jerlov. Raises ValueError for an unknown one.

    Direct light and backscatter follow I = J exp(-bD z) + B (1 - exp(-bB z)), Akkaynak and Treibitz, CVPR 2018: bD and
    bB differ as a camera's colors are broad, and what is left of each spectrum counts. Both are right at a distance of
    one attenuation length. Approximate are the sensitivities (bell curves), daylight (white at the surface), the light
    of deep water (a third of backscatter by absorption, Gordon 1975), and that all scattered light is lost: lenses
    that catch what goes almost straight on see farther.
    """
    if kind not in WATER_TYPES:
        raise ValueError(f"{kind!r} is no water type of {', '.join(WATER_TYPES)}")
    table = {(row[0], row[1]): np.array(row[2:], float) for row in map(str.split, TABLE.strip().splitlines()[1:])}
    nm = np.array(TABLE.split()[1:11], float)
    a, b, fall = (table[kind, what] for what in ("a", "b", "Kd"))
    seen = np.array([np.exp(-0.5 * ((nm - peak) / spread) ** 2) for peak, spread in CAMERA])
    seen /= seen.sum(axis=1, keepdims=True)
    molecules = np.minimum(b, MOLECULES * (550.0 / nm) ** 4.32)
    back = 0.5 * molecules + PARTICLES_BACK * (b - molecules)
    deep, beam = 0.33 * back / (a + back), a + b
    far, down = 1.0 / np.interp(525.0, nm, beam), 1.0 / fall.min()
    return WaterColors(
        -np.log(seen @ np.exp(-beam * far)) / far,
        -np.log((seen * deep) @ np.exp(-beam * far) / (seen @ deep)) / far,
        -np.log(seen @ np.exp(-fall * down)) / down,
        seen @ deep,
    )


def water_visibility(kind: str) -> float:
    """Distance (m) at which 2 % of the contrast of green light is left in a water type."""
    return KOSCHMIEDER_CONSTANT / float(jerlov_colors(kind).direct[1])
