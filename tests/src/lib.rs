//! End-to-end tests: the daemon driven through its API against the simulated scanner.
