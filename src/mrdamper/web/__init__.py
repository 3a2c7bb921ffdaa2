"""The live bench: a local page on which a damper is seen, identified, moved and taken away.

It calls the package and holds no mathematics of its own. `app.create_app` makes the application,
`server.serve` runs it on this machine only; neither is imported here: worker processes need neither.
"""
