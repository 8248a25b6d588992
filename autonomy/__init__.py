"""On-board algorithms as a library: control, guidance, navigation and plans, without a bus, clock or file."""
