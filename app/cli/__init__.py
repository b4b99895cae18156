"""The command line: the same use cases as the page, with no HTTP."""

from app.cli.main import main

__all__ = ["main"]
