"""Local web app to import tests, identify dampers, explore and export them.

It calls the package and holds no mathematics of its own. `app.create_app` makes the application,
`server.serve` runs it on this machine only; neither is imported here: worker processes need neither.
"""
