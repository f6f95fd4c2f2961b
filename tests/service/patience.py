"""How long a test waits for what must come: so long only a program that hangs takes, also on a machine of which others take
most. It is no measure of speed, and less than the time that ctest gives a test."""

PATIENCE = 600
