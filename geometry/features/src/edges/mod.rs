//! Edge points.
