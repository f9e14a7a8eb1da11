"""Make the figures of docs/howto/gradients.md, from what the examples on that page find.

Run ``python scripts/gradient_pages.py`` from the repository's root (half a minute).
"""

import doctest
import re
from typing import Any

import numpy as np
from pages import DOCS, write

import rocking
from rocking.plot.canvas import ACCENT, GREY, INK, add_labels, open_figure


def main() -> None:
    """Write all images."""
    names: dict[str, Any] = {}
    figures = {}
    made = {"gradient.png": gradient_figure, "least-change.png": change_figure}
    page = (DOCS / "howto" / "gradients.md").read_text("utf-8")
    for block, (name, draw) in zip(
        re.findall(r"^```pycon\n(.*?)^```", page, re.DOTALL | re.MULTILINE), made.items(), strict=False
    ):
        for example in doctest.DocTestParser().get_examples(block):
            exec(example.source, names)  # so that no number here is another than there
        figures[name] = draw(names)
    write({}, figures.items())


def gradient_figure(names):
    """Draw a record, the rotation, and the derivative of its peak by each sample."""
    record, response, samples = names["record"], names["response"], names["found"].samples
    times = np.arange(0.0, 14.0, 0.005)
    with open_figure(None, (6.4, 5.0), None, "") as figure:
        ground, rotation, derivative = figure.subplots(3, 1, sharex=True)
        ground.plot(times, record.acceleration(times), color=GREY, linewidth=0.8)
        rotation.plot(times, response.rotation(times), color=INK, linewidth=0.9)
        rotation.plot(response.peak_time, response.rotation(response.peak_time), "o", color=ACCENT, markersize=4.0)
        derivative.plot(record.breakpoints, samples, color=ACCENT, linewidth=0.9)
        add_labels(ground, "", "ground (m/s$^2$)")
        add_labels(rotation, "", "rotation (rad)")
        add_labels(derivative, "time (s)", "derivative\n(rad per m/s$^2$)")
        derivative.set_xlim(0.0, times[-1])
        figure.align_ylabels()
    return figure


def change_figure(names):
    """Draw both records, the change alone, both rotations over the slenderness, and the energy along both searches."""
    statue, samples, change, first = (names[each] for each in ("statue", "samples", "change", "first"))
    times, shown, longer = first + names["step"] * np.arange(len(samples)), slice(1100, 1450), slice(1100, 3300)
    with open_figure(None, (6.4, 6.6), None, "") as figure:
        ground, rotation, energy = figure.subplots(3, 1)
        ground.plot(times[shown], samples[shown], color=GREY, linewidth=2.0, label="record")
        ground.plot(times[shown], (samples + change)[shown], "--", color=INK, linewidth=1.0, label="changed record")
        ground.plot(times[shown], change[shown], color=ACCENT, linewidth=1.2, label="change")
        for label, added, style in (("record", 0.0, "-"), ("changed record", change, "--")):
            response = rocking.simulate(statue, rocking.Motion.from_samples(samples + added, names["step"]))
            lasting = np.minimum(times[longer] - first, response.duration)
            rotation.plot(times[longer], response.rotation(lasting) / statue.balance[0], style, color=INK, label=label)
        for (found, _), style, label in zip(
            names["searches"], ("-", "--"), ("the gradient", "its opposite"), strict=True
        ):
            share = 100.0 * np.array(found) / names["whole"]
            energy.plot(share, style, color=INK, label=f"from {label}")
        energy.set_yscale("log")
        ground.set_ylim(-5.0, 6.0)
        rotation.set_ylim(-0.7, 2.0)
        add_labels(ground, "time (s)", "ground (m/s$^2$)")
        add_labels(rotation, "time (s)", "rotation over slenderness")
        add_labels(energy, "step of the search", "energy of the change\n(% of the record's)")
        for axes in (ground, rotation, energy):
            axes.legend(frameon=False, fontsize="small", ncols=3)
        figure.align_ylabels()
    return figure


if __name__ == "__main__":
    main()
