"""PROFIBUS: telegrams of its data link layer (FDL), services of DP-V0, and PKW and PZD of the profile DSP-408.

Pure: bytes to objects and back, no clock and no line (IEC 61158 type 3; ED2 manual, chapter 4).
"""
