"""The live bench: a local page on which a damper is seen, identified, moved and taken away.

It calls the package and holds no mathematics of its own. `create_app` makes the
application, `serve` runs it on this machine only.
"""

from mrdamper.web.app import create_app
from mrdamper.web.server import serve

__all__ = ["create_app", "serve"]
