//! The HTTP types of the Relief service, shared by server and clients.
