"""The time that a test waits for something that must come. Only a program that hangs takes as long, also on a machine of which
others take most: it is no measure of speed. ctest gives a test more."""

PATIENCE = 600
