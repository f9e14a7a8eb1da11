"""The dimensionless sine problem: one arc, one impact, one chattering sequence, to a few ulp.

The paper's problem (Eq. 4) in variables in which nothing cancels:

- phase ``x = omega tau`` since uplift, ``delta = 1/omega^2``, height ``U = omega^2 |phi|``, speed ``V = dU/dx``;
- ``P = 1 - a sin(x + psi) = 1 - cos x - kappa sin x``, the restoring acceleration of the first side; that of the
  second is ``2 - P``; ``D = dP/dx = sin x - kappa cos x`` and ``kappa = sqrt(a^2 - 1)``.

On an arc of the first (s = 1) or second (s = -1) side ``U'' = delta U - G - s (change of P)``, with G = P or 2 - P at
its start. Divided by the time t since that impact (Eq. 20) its solution is

    U/t = V A - t (G B + s t (D E + t (1 - P) W)),

where A, B, E, W are functions of t^2 and delta (``basis``), sums of terms of falling size however short the arc is.
P and D advance by the addition theorem, so that an impact calls neither sine nor exponential.

Every positive root of U/t with x + t < pi is the first one. From the first impact to x = pi, half a period after
uplift, both restoring accelerations are positive, so once an arc has come down to zero, U'' = delta U - g < 0 keeps
it below. Hence no search for an earlier root; and an arc that is still up at x = pi proves incomplete chattering.

Under slow forcing an arc grows like exp(t/omega), beyond the range of a double. Of a long arc only the sign and the
root are needed, which a positive factor does not change: there the basis is multiplied by exp(-t/omega).

The result for an arc or a sequence is a `Verdict`, never a number that is NaN or infinite.
"""

from enum import IntEnum


class Verdict(IntEnum):
    """The result for an arc or a sequence."""

    #: The impact, or the phase of rest, is found (the latter with a proof).
    FOUND = 0
    #: An arc is still up at x = pi: chattering is incomplete.
    INCOMPLETE = 1
    #: Neither is certain in double precision.
    UNRESOLVED = 2
