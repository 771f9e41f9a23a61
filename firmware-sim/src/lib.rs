//! Runs the Gestus core as firmware would.
