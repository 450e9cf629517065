//! Local maps emitted for the catalogue.
