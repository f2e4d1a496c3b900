"""Ask for it: the command line. No science in here.

One page per verb; `stiction.apps.cli` names them. Pages import what is heavy inside their functions only.
"""
