"""What schemathesis checks beside its own: that nothing is the service's fault."""

import schemathesis

# Refusals with a status of 500 and more that are nobody's fault: the scanner or the disk
# is in the way, or too much is going on.
EXPECTED = {
    "busy-regridding",
    "no-room",
    "scanner-fault",
    "scanner-refused",
    "scanner-silent",
    "scanner-trouble",
    "too-many-listeners",
}


@schemathesis.check
def no_fault_of_the_service(ctx, response, case):
    """A status of 500 and more is a fault unless its problem says otherwise."""
    if response.status_code >= 500:
        kind = response.json()["type"]
        assert kind in EXPECTED, f"{response.status_code} {kind}"
