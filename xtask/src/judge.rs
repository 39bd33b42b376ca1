//! Lets independent programs judge the CAD files of simulated scans.
