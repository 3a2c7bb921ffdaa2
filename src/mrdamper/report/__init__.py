"""Results for readers: tables, figures, and pages that hold both."""
