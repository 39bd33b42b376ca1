//! Range images to regions of one surface each.
