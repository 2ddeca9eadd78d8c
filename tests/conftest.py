"""float64: the tests' own settings (the package never touches jax.config)."""

import jax

jax.config.update("jax_enable_x64", True)
