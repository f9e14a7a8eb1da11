"""Eqs 57 to 65 of the paper as they stand, with the amplitude and the frequency in every term.

Only the mends that the iterative procedure needs: the powers of eps count halves, and it runs for a given number of
cycles.
"""

import math

import numpy as np


def cycles(a: float, omega: float, eta: float, count: int):
    """(T_{n;1}, T_{n;3}) of each cycle n, one of them zero, and the speed after its impact over eps^(3/2)."""
    i0 = -1
    sigma1 = 0.0
    velocity3 = 0.0
    terms = []
    for n in range(count):
        sign = i0 if n % 2 == 0 else -i0
        d0 = -i0 / a
        d2 = math.sqrt(2) / a * omega * sigma1 + i0 / (2 * a) * (omega * sigma1) ** 2
        c1 = math.sqrt(2) / a + i0 / a * omega * sigma1
        phi2_0, phi2_2 = -(sign + a * d0) / 2, -a / 2 * d2
        phi3_1 = -a * omega / 6 * c1
        phi4_0 = (-sign + a * (omega**2 - 1) * d0) / 24
        first = third = 0.0
        if sign == i0:
            roots = np.roots([phi4_0, phi3_1, phi2_2, velocity3])
            (first,) = (z.real for z in roots if abs(z.imag) < 1e-9 * abs(z) and z.real > 1e-300)
        else:
            third = -velocity3 / phi2_0
        velocity3 = eta * (
            velocity3 + 2 * phi2_0 * third + 2 * phi2_2 * first + 3 * phi3_1 * first**2 + 4 * phi4_0 * first**3
        )
        sigma1 += first
        terms.append((first, third, abs(velocity3)))
    return terms
