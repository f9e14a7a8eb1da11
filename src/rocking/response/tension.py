"""Forces of the ground on a block whose tendon yields: what it pulls depends on how far it was stretched before."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rocking.arrays import Floats, Integers
from rocking.block import RestrainedBlock
from rocking.kernels.state import TendonLaw
from rocking.response.history import Contact


@dataclass(frozen=True)
class TendonContact(Contact):
    """As `Contact`, of a body with a tendon that yields."""

    body: RestrainedBlock

    def _forces_in(self, times: Floats, rows: Integers) -> tuple[Floats, Floats]:
        """Compute the forces in the steps that start at these rows, the tendon's pull among them."""
        theta, rate, acceleration = self.history.states_in(times, rows).T
        side = self.history.trail.nodes["side"][rows]
        ground = self._ground_in(times, rows, side < 0)
        stretched = self._elongations(np.abs(theta), side)
        tension = self.body.tension(stretched - self._plastic()[rows])
        return self.body.contact_forces((theta, rate, acceleration), ground, side, tension)

    def _elongations(self, rotations: Floats, side: Integers) -> Floats:
        """Elongation of the tendon at rotations to each side, m."""
        opening = np.array([tendon.opening for tendon in self.body._tendon])[np.maximum(side, 0)]
        bend = 2.0 * np.sin(0.5 * rotations) if self.history.trail.rules["nonlinear"] else rotations
        return np.asarray(opening * bend)

    def _plastic(self) -> Floats:
        """Plastic elongation from each node on, m: it changes where the tendon ends to yield, and at a far start."""
        nodes = self.history.trail.nodes
        law, side = nodes["law"], nodes["side"]
        changes = np.append(side[:1] >= 0, (law[1:] == TendonLaw.ELASTIC) & (law[:-1] == TendonLaw.PLASTIC))
        yields = self.body._tendon[0].yields
        after = np.maximum(0.0, self._elongations(nodes["u"], side) - yields)
        last = np.maximum.accumulate(np.where(changes, np.arange(len(nodes)), -1))
        return np.where(last >= 0, after[last], 0.0)
