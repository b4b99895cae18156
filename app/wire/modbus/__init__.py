"""Modbus TCP as the Nanotec PD4-E speaks it: byte codec, stream splitter, process image, passive decoder. Pure.

Three byte orders stand on one socket: the MBAP header, registers, addresses and counts are high byte first; the data
and abort codes of FC 43 are low byte first; indices and data of object frames (FC 101 to 103) are low byte first.
"""
