//! Losses to weights: what the network learns from, and how.
