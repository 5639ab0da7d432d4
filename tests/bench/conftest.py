from jaxmotor.bench._emulator import missing_tools


def pytest_collection_modifyitems(config, items):
    """Without the toolchain one test says so for all here that need it."""
    if not missing_tools():
        return
    mine = [item for item in items if "emulator" in getattr(item, "fixturenames", ()) and "tests/bench/" in item.nodeid]
    config.hook.pytest_deselected(items=mine[1:])
    items[:] = [item for item in items if item not in mine[1:]]
