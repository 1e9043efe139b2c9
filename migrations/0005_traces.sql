-- The trace that a job was submitted in (traceparent of W3C Trace Context, as it goes on from the
-- request), for the lines of the log that its runs write; '' where there is none.
ALTER TABLE job ADD COLUMN trace TEXT NOT NULL DEFAULT '';
