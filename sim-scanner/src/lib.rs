//! A simulated slide-table laser scanner: optics, mechanics, noise, faults, and the device's side of the protocol.
