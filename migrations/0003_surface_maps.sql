-- Scalar maps that travel with a surface, such as the significance of a difference at each point:
-- values on a Gauss-Legendre grid, all maps in one array. names are separated by commas.
CREATE TABLE surface_maps (
    surface TEXT PRIMARY KEY NOT NULL REFERENCES surface (id) ON DELETE CASCADE,
    names   TEXT NOT NULL,
    maps    INTEGER NOT NULL CHECK (maps > 0),
    n_theta INTEGER NOT NULL CHECK (n_theta > 0),
    n_phi   INTEGER NOT NULL CHECK (n_phi > 0),
    content TEXT NOT NULL REFERENCES blob (hash)
) STRICT;
CREATE INDEX surface_maps_by_content ON surface_maps (content);
