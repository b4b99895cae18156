"""Records of restores: what they hold, their signature, how they are printed, and how a file of one is checked."""
