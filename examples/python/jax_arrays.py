"""Boxes in JAX arrays. A compiled function gets the pairs through a callback."""

# snippet-begin: jax
import jax
import jax.numpy as jnp
import numpy
import throng

lower = jax.random.uniform(jax.random.key(1), (1000, 3))
boxes = jnp.concatenate([lower, lower + 0.1], axis=1)
pairs = throng.find_pairs(boxes, result="same")


@jax.jit
def touched(boxes: jax.Array) -> jax.Array:  # jit needs fixed sizes: one value per box
    def count(boxes: jax.Array) -> throng.Array:
        found = throng.find_pairs(boxes, result="numpy")
        return numpy.bincount(found.reshape(-1), minlength=len(boxes)).astype(numpy.int32)

    return jax.pure_callback(count, jax.ShapeDtypeStruct(boxes.shape[:1], jnp.int32), boxes)


# snippet-end: jax
assert int(touched(boxes).sum()) == 2 * len(pairs) > 0
