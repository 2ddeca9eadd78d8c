"""float64, no silent promotion of ranks: the tests' own settings (the package never touches jax.config)."""

import jax

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
