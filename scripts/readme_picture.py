"""Make the moving picture of the README: a block under a record, its rotation, and the impacts that bring it to rest.

Run ``python scripts/readme_picture.py`` from the repository's root; it takes half a minute.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from PIL import Image

import rocking
from rocking.plot.canvas import ACCENT, GREY, INK, PALE

FILE = Path(__file__).resolve().parents[1] / "docs" / "_static" / "rocking.webp"

#: What is shown of the record, s; pictures, and how many a second.
START, END = 230.4, 239.9
RATE = 12
FRAMES = round(RATE * (END - START))
#: The last picture stays for so long, s.
STAY = 2.5

WIDTH, HEIGHT = 0.24, 1.10
#: The block turns by so many times its rotation, which would hardly be seen.
LARGER = 3.0
COLOURS = 48


def main() -> None:
    """Simulate, draw every picture, write them into one file."""
    motion = rocking.records.load("ridgecrest-clc-090").scaled_to(0.42 * 9.80665)
    response = rocking.simulate(rocking.Block(width=WIDTH, height=HEIGHT), motion)
    sys.stdout.write(response.summary() + "\n")
    drawing = Drawing(response, motion)
    pictures = [drawing.at(moment) for moment in np.linspace(START, END, FRAMES)]
    # One palette for all: what does not move is the same in every picture.
    palette = pictures[len(pictures) // 2].quantize(COLOURS, dither=Image.Dither.NONE)
    few = [picture.quantize(palette=palette, dither=Image.Dither.NONE).convert("RGB") for picture in pictures]
    durations = [1000 // RATE] * (len(few) - 1) + [round(1000 * STAY)]
    few[0].save(
        FILE, save_all=True, append_images=few[1:], duration=durations, loop=0, lossless=True, method=4, quality=60
    )
    sys.stdout.write(f"{FILE}: {FILE.stat().st_size // 1000} kB, {len(few)} pictures\n")


class Drawing:
    """The block at the left; its rotation, the motion and the impacts at the right."""

    def __init__(self, response: rocking.Response, motion: rocking.Motion) -> None:
        self.response = response
        self.figure = Figure(figsize=(8.0, 3.6), dpi=100, layout="constrained")
        grid = self.figure.add_gridspec(3, 2, width_ratios=(1.0, 3.0), height_ratios=(2.2, 1.4, 0.4))
        self.stage = self.figure.add_subplot(grid[:, 0])
        panels = [self.figure.add_subplot(grid[row, 1]) for row in range(3)]
        time = np.linspace(START, END, 3000)
        self.draw_stage()
        self.draw_panels(panels, time, motion)
        self.cursors = [panel.axvline(START, color=ACCENT, linewidth=1.2) for panel in panels]
        # The panels stay where they are, and need not be laid out again for each picture.
        self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")

    def draw_stage(self) -> None:
        """Draw the ground, and the block, which moves."""
        self.stage.set_aspect("equal")
        self.stage.set_axis_off()
        self.stage.set(xlim=(-0.42, 0.42), ylim=(-0.2, 1.35))
        self.stage.axhspan(-0.06, 0.0, facecolor=PALE)
        self.stage.axhline(0.0, color=INK, linewidth=1.2)
        self.block = Polygon(np.zeros((4, 2)), facecolor="#cfc6b8", edgecolor=INK, linewidth=1.4)
        self.stage.add_patch(self.block)
        self.words = self.stage.text(0.0, -0.15, "", ha="center", va="center", color=INK)
        self.stage.text(
            0.0,
            1.27,
            f"{WIDTH:.2f} m × {HEIGHT:.2f} m\nrotation drawn × {LARGER:g}",
            ha="center",
            va="center",
            color=INK,
        )

    def draw_panels(self, panels, time, motion) -> None:
        """Draw what does not move."""
        rotation, ground, impacts = panels
        rotation.plot(time, np.degrees(self.response.rotation(time)), color=INK, linewidth=1.2)
        rotation.set_ylabel("rotation (°)")
        rotation.set_title("Ridgecrest 2019, China Lake, scaled to 0.42 g", loc="left", fontsize="medium", color=INK)
        threshold = WIDTH / HEIGHT
        ground.plot(time, motion.acceleration(time) / 9.80665, color=GREY, linewidth=0.8)
        for level in (-threshold, threshold):
            ground.axhline(level, color=INK, linewidth=0.8, linestyle=(0, (5, 2)))
        ground.set_ylabel("ground (g)")
        impacts.vlines(self.response.impacts["time"], 0.0, 1.0, color=INK, linewidth=0.5)
        impacts.set_yticks([])
        impacts.set_ylabel("impacts", rotation=0, ha="right", va="center")
        impacts.set_xlabel("time (s)")
        events = self.response.events
        ends = [*events["time"], np.inf]
        for at, kind, until in zip(events["time"], events["kind"], ends[1:], strict=True):
            if kind == "rest":
                for panel in (rotation, impacts):
                    panel.axvspan(max(at, START), min(until, END), color=PALE, linewidth=0.0, zorder=0)
        for panel in panels:
            panel.set_xlim(START, END)
            panel.spines[["top", "right"]].set_visible(False)
            panel.tick_params(labelbottom=panel is impacts)

    def at(self, moment: float) -> Image.Image:
        """Draw one moment."""
        angle = float(self.response.rotation(moment))
        # A positive rotation is clockwise, about the right lower corner.
        pivot = np.array([0.5 * WIDTH if angle > 0.0 else -0.5 * WIDTH, 0.0])
        corners = np.array([(-0.5, 0.0), (0.5, 0.0), (0.5, 1.0), (-0.5, 1.0)]) * (WIDTH, HEIGHT) - pivot
        cosine, sine = np.cos(LARGER * angle), np.sin(LARGER * angle)
        self.block.set_xy(corners @ np.array([[cosine, -sine], [sine, cosine]]) + pivot)
        past = self.response.events[self.response.events["time"] <= moment]
        still = not len(past) or past["kind"][-1] == "rest"
        self.words.set_text("at rest" if still else "rocking")
        for cursor in self.cursors:
            cursor.set_xdata([moment, moment])
        drawn = io.BytesIO()
        self.figure.savefig(drawn, format="png", facecolor="white")
        return Image.open(drawn).convert("RGB")


if __name__ == "__main__":
    main()
