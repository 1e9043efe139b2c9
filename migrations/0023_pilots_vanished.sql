-- Arrays that Slurm took and never showed. They are looked for some minutes more, also by a daemon
-- that was started again meanwhile.
ALTER TABLE pilots ADD COLUMN vanished INTEGER NOT NULL DEFAULT 0 CHECK (vanished IN (0, 1));
