// Many shapes in one picture, as papers show them: a line for each component or each path, all to one scale and from one
// side.
import { useState } from 'preact/hooks';
import { boundsOf } from './geometry';
import type { Surface3 } from './glb';
import { t } from './i18n';
import { Camera, draw, forget } from './stage';
import { ProblemBox, save } from './ui';

export interface MontageRow { text: string; shapes: Surface3[] }

const CELL = 480; // pixels
const INK = '#222222';

/** Columns have a text each, above the first row. Shapes that nothing else shows are forgotten after. */
export function montage(rows: MontageRow[], columns: string[], camera: Camera): Promise<Blob> {
    const bounds = boundsOf(rows.flatMap((r) => r.shapes));
    const left = rows.some((r) => r.text) ? CELL * 0.6 : 0;
    const top = CELL * 0.16;
    const canvas = document.createElement('canvas');
    canvas.width = left + CELL * columns.length;
    canvas.height = top + CELL * rows.length;
    const pen = canvas.getContext('2d')!;
    pen.fillStyle = '#ffffff';
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.fillStyle = INK;
    pen.font = `${CELL / 14}px Helvetica, Arial, sans-serif`;
    pen.textAlign = 'center';
    columns.forEach((text, c) => pen.fillText(text, left + (c + 0.5) * CELL, top * 0.7, CELL * 0.95));
    pen.textAlign = 'left';
    const one = document.createElement('canvas');
    one.width = one.height = CELL;
    rows.forEach((row, r) => {
        row.text.split('\n').forEach((line, i) => pen.fillText(line, CELL / 20, top + (r + 0.5) * CELL + (i * CELL) / 11, left * 0.92));
        row.shapes.forEach((shape, c) => {
            draw(one, [{ shape }], camera, { ...bounds, background: '#ffffff' });
            pen.drawImage(one, left + c * CELL, top + r * CELL);
        });
    });
    return new Promise((yes) => canvas.toBlob((blob) => yes(blob!), 'image/png'));
}

/** Takes the picture away; rows are made when they are asked for. */
export function MontageButton({ rows, columns, camera, name, title }: {
    rows: () => Promise<MontageRow[]>; columns: string[]; camera: Camera; name: string; title: string;
}) {
    const [busy, setBusy] = useState(false);
    const [error, setError] = useState<unknown>();
    const make = async () => {
        setBusy(true);
        setError(undefined);
        try {
            const made = await rows();
            save(`${name}.png`, await montage(made, columns, camera));
            made.forEach((row) => row.shapes.forEach(forget));
        } catch (e) {
            setError(e);
        }
        setBusy(false);
    };
    return <><button disabled={busy} onClick={() => void make()}>{busy ? t`Drawing…` : title}</button>{error ? <ProblemBox error={error} /> : null}</>;
}
