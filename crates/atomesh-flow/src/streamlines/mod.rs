//! Streamlines and times of flight.
