"""Dimensionless sine problem: one arc, one impact, one chattering sequence, to a few ulp.

The paper's problem (Eq. 4) in variables without cancellation:

- phase ``x = omega tau`` since uplift, ``delta = 1/omega^2``, height ``U = omega^2 |phi|``, speed ``V = dU/dx``;
- ``P = 1 - a sin(x + psi) = 1 - cos x - kappa sin x``, the restoring acceleration of the first side (``2 - P`` for the
  second); ``D = dP/dx = sin x - kappa cos x`` and ``kappa = sqrt(a^2 - 1)``.

On an arc of the first (s = 1) or second (s = -1) side, ``U'' = delta U - G - s (change of P)``, with the initial value
G = P or 2 - P. The solution, divided by the time t since that impact (Eq. 20), is

    U/t = V A - t (G B + s t (D E + t (1 - P) W)),

where A, B, E, W are functions of t^2 and delta (``basis``), sums of decreasing terms for arbitrarily short arcs. P and
D advance by the addition theorem, without sine or exponential at an impact.

Every positive root of U/t with x + t < pi is the first root: between the first impact and x = pi, half a period after
uplift, both restoring accelerations are positive, so that once an arc has reached zero, U'' = delta U - g < 0 keeps it
below. An arc that is still up at x = pi proves incomplete chattering.

Under slow forcing an arc grows like exp(t/omega), beyond the range of a double. Only the sign and root of a long arc
are needed, and are unchanged if the basis is multiplied by exp(-t/omega).

The result for an arc or a sequence is a `SequenceStatus`, never NaN or infinity.
"""

from enum import IntEnum


class SequenceStatus(IntEnum):
    """Result for an arc or a sequence."""

    #: The impact, or the phase of rest, is found (the latter with a proof).
    FOUND = 0
    #: An arc is still up at x = pi: chattering is incomplete.
    INCOMPLETE = 1
    #: Neither is certain in double precision.
    UNRESOLVED = 2
