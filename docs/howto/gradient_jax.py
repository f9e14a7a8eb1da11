"""The peak rotation of a block as a function that JAX differentiates, and an impact as a time-stepping engine has it.

Needs JAX (``pip install jax``).
"""

import jax
import jax.numpy as jnp
import numpy as np

import rocking

jax.config.update("jax_enable_x64", True)

BLOCK = rocking.Block(width=0.24, height=1.1)
STEP = 0.02


def answer(samples):
    """Peak rotation under a record, rad, and its derivatives by the samples, rad per m/s^2."""
    response = rocking.simulate(
        BLOCK, rocking.Motion.from_samples(np.asarray(samples), STEP)
    )
    found = rocking.gradient(response)
    return np.float64(found.value), found.samples


def forward(samples):
    """Ask for both at once; JAX keeps the derivatives until it comes back."""
    shapes = (
        jax.ShapeDtypeStruct((), jnp.float64),
        jax.ShapeDtypeStruct(samples.shape, jnp.float64),
    )
    return jax.pure_callback(answer, shapes, samples, vmap_method="sequential")


def backward(slopes, change):
    """Take a change with the peak to one with the samples."""
    return (change * slopes,)


@jax.custom_vjp
def peak(samples):
    """Peak rotation, rad, of samples in m/s^2."""
    return forward(samples)[0]


peak.defvjp(forward, backward)


def record(parts):
    """Sum four sines, of 1 to 3 Hz, that fade in and out over 4 s, m/s^2."""
    time = STEP * jnp.arange(201)
    frequencies = jnp.array([1.0, 1.5, 2.0, 3.0])
    waves = jnp.sin(2.0 * jnp.pi * frequencies[:, None] * time)
    return jnp.sin(jnp.pi * time / 4.0) ** 2 * (parts @ waves)


def stepped(start, step, end=1.0, p=2.0, alpha=0.2, restitution=0.8):
    """Rotation at a time of a block of the linear model that is released, by time steps: what an engine differentiates.

    Symplectic Euler; where the rotation has changed its sign, the velocity is multiplied by the restitution.
    """

    def advance(state, _):
        rotation, velocity = state
        velocity = velocity + step * p * p * (
            rotation - alpha * jnp.sign(rotation)
        )
        after = rotation + step * velocity
        velocity = jnp.where(
            after * rotation < 0.0, restitution * velocity, velocity
        )
        return (after, velocity), None

    (rotation, _), _ = jax.lax.scan(
        advance, (start, 0.0 * start), length=round(end / step)
    )
    return rotation


def main():
    """Print derivatives beside differences; return them, and those of an impact by steps with the exact one."""
    parts = jnp.array([0.5, 1.4, 2.4, -1.0])
    found = jax.jit(jax.grad(lambda each: peak(record(each))))(parts)
    h = 1e-5
    differences = [
        (peak(record(parts + h * e)) - peak(record(parts - h * e))) / (2.0 * h)
        for e in jnp.eye(4)
    ]
    several = jax.vmap(jax.grad(lambda each: peak(record(each))))(
        jnp.stack([parts, 0.9 * parts])
    )
    print(f"peak rotation {peak(record(parts)):.6f} rad")
    for slope, difference in zip(found, differences, strict=True):
        print(
            f"by an amplitude: {slope:+.8f} rad per m/s^2, by differences {difference:+.8f}"
        )

    block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.8)
    response = rocking.simulate(
        block, None, model="linear", initial_rotation=0.1, duration=1.0
    )
    exact = float(response.sensitivity.rotation(1.0)["initial_rotation"]) / 0.1
    print(
        f"one impact, at {response.impacts['time'][0]:.4f} s: rotation at 1 s by that at the release: {exact:.6f}"
    )
    steps = {
        step: float(jax.grad(stepped)(0.1, step)) for step in (1e-2, 1e-3, 1e-4)
    }
    for step, slope in steps.items():
        error = float(stepped(0.1, step)) - float(response.rotation(1.0))
        print(
            f"in steps of {step:g} s: {slope:.6f}; the rotation itself is off by {error:+.1e} rad"
        )
    return (
        np.array(found),
        np.array(differences),
        np.array(several),
        steps,
        exact,
    )


if __name__ == "__main__":
    main()
