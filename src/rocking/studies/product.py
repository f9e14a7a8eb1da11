"""What a study computes, as a file that needs no script: blocks, motions, scales and rules, each part with its hash.

And which outcomes of its simulations a study keeps, and whether they are enough for what is asked of it.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import rocking.dynamics.bodies  # noqa: F401 -- its kinds are known from then on
from rocking.block.body import KINDS, Bodies
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.engine.treatment import treatment
from rocking.errors import InvalidOption, StudyError
from rocking.motion.description import Description
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure
from rocking.simulation.ensemble import VARIABLES, Product, Scales

#: All outcomes of a simulation, in the order in which a store holds them.
OUTCOMES: Final = tuple(VARIABLES)

#: Kept whatever is chosen: without them nobody could tell an answer from one that was given up, stopped or not proven.
ALWAYS_KEPT: Final = ("stalled", "unfinished", "stopped")


def chosen_outcomes(outcomes: Sequence[str] | None) -> tuple[str, ...]:
    """Return the outcomes that a study of this choice keeps, in the order of the store; all without a choice."""
    if outcomes is None:
        return OUTCOMES
    names = checks.several(outcomes, "outcomes", InvalidOption)
    if not names:
        raise InvalidOption(
            f"{{}} must name one or more of {', '.join(OUTCOMES)}; leave it out to keep all", "outcomes"
        )
    for name in names:
        if name not in OUTCOMES:
            raise InvalidOption(
                f"each of {{}} must be one of {', '.join(OUTCOMES)}, not {checks.shown(name)}", "outcomes", value=name
            )
    repeated = [name for name, count in Counter(names).items() if count > 1]
    if repeated:
        raise InvalidOption(f"{{}} names {repeated[0]} more than once: name it once", "outcomes", value=repeated[0])
    return tuple(name for name in OUTCOMES if name in {*names, *ALWAYS_KEPT})


def require(kept: Sequence[str], needed: Sequence[str], what: str, *arguments: str) -> None:
    """Check that the outcomes that are kept are enough for something, which may name arguments."""
    missing = [name for name in needed if name not in kept]
    if missing:
        choice = [name for name in OUTCOMES if name in {*kept, *needed} and name not in ALWAYS_KEPT]
        raise InvalidOption(
            f"{what} needs {' and '.join(missing)}, and the study keeps only {', '.join(kept)}: create one with "
            f"{{}} = {json.dumps(choice)}",
            *arguments,
            "outcomes",
        )


def outcomes_text(kept: Sequence[str]) -> str:
    """Write in a few words what is kept."""
    return "all" if len(kept) == len(OUTCOMES) else ", ".join(kept)


def hashes(product: Product) -> dict[str, Any]:
    """Hash of every part of the inputs by its name; those of the motions in a list."""
    scales, bodies, arrays = product.scales, product.bodies, _body_arrays(product.bodies)
    # Others than blocks may have equal arrays and differ in kind.
    names = [] if bodies.kind == "blocks" else [_text(json.dumps([bodies.kind, *arrays]))]
    return {
        "blocks": _hash([*names, *arrays.values()]),
        "motions": [_hash(_motion_arrays(motion).values()) for motion in product.motions],
        "scales": _hash([scales.values, _text(json.dumps([*_measured(scales).values()]))]),
        "rules": _hash([_text(json.dumps(_rules(product)))]),
    }


def to_bytes(product: Product) -> bytes:
    """Return all inputs as an archive of arrays (NPZ), whose bytes depend on them alone."""
    arrays = {f"{product.bodies.kind}/{name}": values for name, values in _body_arrays(product.bodies).items()}
    for k, motion in enumerate(product.motions):
        arrays |= {f"motions/{k}/{name}": values for name, values in _motion_arrays(motion).items()}
    arrays["scales/values"] = product.scales.values
    arrays["words"] = _text(json.dumps(_measured(product.scales) | {"motions": len(product.motions)} | _rules(product)))
    return archive(arrays)


def from_bytes(data: bytes) -> Product:
    """Read inputs from such an archive."""
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        words = json.loads(bytes(arrays["words"]))
        return Product(
            bodies=_bodies(arrays),
            motions=tuple(_motion(arrays, f"motions/{k}") for k in range(words["motions"])),
            scales=Scales(
                None if words["measure"] is None else Measure(words["measure"], **words["options"]),
                arrays["scales/values"],
            ),
            polarity=words["polarity"],
            model=words["model"],
            treatment=treatment(words["treatment"]),
            duration=words["duration"],
        )


def _measured(scales: Scales) -> dict[str, Any]:
    return {
        "measure": scales.measure and scales.measure.name,
        "options": scales.measure.options() if scales.measure else {},
    }


def _rules(product: Product) -> dict[str, Any]:
    return {
        "polarity": product.polarity,
        "model": product.model,
        "treatment": str(product.treatment),
        "duration": product.duration,
    }


def changes(now: Mapping[str, Any], then: Mapping[str, Any], motions: Sequence[Motion]) -> list[str]:
    """Name the parts of a study's inputs whose hashes differ."""
    found = [
        {"blocks": "the blocks", "scales": "the scales", "rules": "the polarity, model, treatment or duration"}[part]
        for part in ("blocks", "scales", "rules")
        if now[part] != then[part]
    ]
    if len(now["motions"]) != len(then["motions"]):
        return [*found, f"the number of motions ({len(then['motions'])} then, {len(now['motions'])} now)"]
    pairs = enumerate(zip(now["motions"], then["motions"], strict=True))
    different = [k for k, (new, old) in pairs if new != old]
    return found + [f"motion {k} ({motions[k].name})" for k in different[:3]] + ["more motions"] * (len(different) > 3)


def _hash(arrays: Iterable[NDArray[Any]]) -> str:
    digest = hashlib.sha256()
    for array in arrays:
        values = np.asarray(array, order="C")
        digest.update(f"{values.dtype.str}{values.shape}".encode())
        digest.update(values.tobytes())
    return digest.hexdigest()


def _body_arrays(bodies: Bodies) -> dict[str, NDArray[Any]]:
    return {name: values for name, (values, _) in bodies.parameters().items()} | {"gravity": np.array(bodies.gravity)}


def _bodies(arrays: Mapping[str, Floats]) -> Bodies:
    """Make the bodies again; the names of their arrays begin with their kind."""
    kind = next((folder for folder in (name.partition("/")[0] for name in arrays) if folder in KINDS), "")
    if not kind:
        raise StudyError("the bodies of this study are of a kind that is not known here: import its module first")
    values = {name.partition("/")[2]: arrays[name] for name in arrays if name.startswith(f"{kind}/")}
    return KINDS[kind](**{**values, "gravity": float(values["gravity"])})


def _motion_arrays(motion: Motion) -> dict[str, NDArray[Any]]:
    description = motion.description
    words = {
        "name": motion.name,
        "family": description.family,
        "parameters": dict(description.parameters),
        "text": description.text,
        "history": motion.history,
        "error": motion.error,
    }
    arrays: dict[str, NDArray[Any]] = {
        "breakpoints": motion.breakpoints,
        "coefficients": motion.coefficients,
        "words": _text(json.dumps(words)),
    }
    if motion.vertical is not None:
        arrays |= {f"vertical/{name}": values for name, values in _motion_arrays(motion.vertical).items()}
    return arrays


def _motion(arrays: Mapping[str, NDArray[Any]], place: str) -> Motion:
    words = json.loads(bytes(arrays[f"{place}/words"]))
    return Motion(
        arrays[f"{place}/breakpoints"],
        arrays[f"{place}/coefficients"],
        name=words["name"],
        description=Description(words["family"], words["parameters"], words["text"]),
        history=tuple(words["history"]),
        error=words["error"],
        vertical=_motion(arrays, f"{place}/vertical") if f"{place}/vertical/words" in arrays else None,
    )


def _text(words: str) -> NDArray[np.uint8]:
    return np.frombuffer(words.encode(), np.uint8)


def archive(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Archive of arrays (NPZ) whose bytes depend on the arrays alone."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as file:
        for name, values in arrays.items():
            entry = io.BytesIO()
            np.lib.format.write_array(entry, np.asarray(values, order="C"), allow_pickle=False)
            about = zipfile.ZipInfo(f"{name}.npy", (1980, 1, 1, 0, 0, 0))
            about.compress_type = zipfile.ZIP_DEFLATED
            file.writestr(about, entry.getvalue())
    return buffer.getvalue()
