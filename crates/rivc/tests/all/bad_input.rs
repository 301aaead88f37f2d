//! What cannot be is refused in one line.
