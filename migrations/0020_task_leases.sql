-- When a lease expires is no longer kept: it is counted by the clock that nobody can set, in the
-- daemon's memory, and after a restart anew from when the job comes to its tasks again. So a
-- heartbeat writes nothing.
ALTER TABLE task DROP COLUMN expires_ms;
