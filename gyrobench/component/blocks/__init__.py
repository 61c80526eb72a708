"""Pieces that parts are made of.  The equations of a part stand in its own file and in one of these."""
