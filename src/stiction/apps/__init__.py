"""The command line and the web page. Nothing scientific is computed here.

One file for each command; `stiction.apps.cli` lists them. Slow imports are made inside functions.
"""
