"""The functions of `math` for expressions, so that code can be handed `math` or this module."""

import numpy as np

sqrt, exp, expm1, log, log1p = np.sqrt, np.exp, np.expm1, np.log, np.log1p
tan, atan, tanh, atanh = np.tan, np.arctan, np.tanh, np.arctanh
