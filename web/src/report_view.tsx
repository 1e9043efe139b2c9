// The program of a report: draws its charts and its shapes from the data in it. Part of report.html, the frame that the
// service and the dashboard fill.
import { render } from 'preact';
import { useEffect, useMemo, useRef, useState } from 'preact/hooks';
import { Findings } from './findings';
import { boundsOf, normalsOf } from './geometry';
import type { Field, Surface3 } from './glb';
import { ColourBar, mapOf, paintedBy } from './maps';
import { able, draw, onTurn, rotate, turnTo } from './report_stage';
import { figure, save } from './text';

/** Numbers in base64: positions of 16 bits in parts of the radius, maps of 16 bits from low to high, colours of 8. */
interface Packed {
    list: number; centre: number[]; radius: number; positions: string; colours?: string;
    maps?: { name: string; unit: string; meaning: string; low: number; high: number; values: string }[];
}
interface ViewOf { kind?: 'mode' | 'path'; shapes: number[]; texts?: string[] }
interface Data {
    turn?: number[]; lists: { bits: 16 | 32; data: string }[]; shapes: Packed[]; views: ViewOf[];
    sections: { process: string; results: any }[];
}
interface Shape extends Surface3 { colours?: Float32Array }

const raw = (text: string): ArrayBuffer => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
const linear = (c: number): number => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
const BONE = [0.784, 0.69, 0.565].map(linear);

let data: Data;
const lists = new Map<number, Uint32Array>();
const shapes = new Map<number, Shape>();

function listAt(i: number): Uint32Array {
    let list = lists.get(i);
    if (!list) {
        const { bits, data: text } = data.lists[i];
        list = bits === 16 ? Uint32Array.from(new Uint16Array(raw(text))) : new Uint32Array(raw(text));
        lists.set(i, list);
    }
    return list;
}

function shapeAt(i: number): Shape {
    let shape = shapes.get(i);
    if (!shape) {
        const packed = data.shapes[i];
        const positions = Float32Array.from(new Int16Array(raw(packed.positions)), (v, k) => packed.centre[k % 3] + (packed.radius * v) / 32767);
        const fields: Field[] = (packed.maps ?? []).map(({ values, ...map }) => ({
            ...map, values: Float32Array.from(new Uint16Array(raw(values)), (v) => map.low + (v / 65535) * (map.high - map.low)),
        }));
        shape = { positions, normals: new Float32Array(positions.length), indices: listAt(packed.list), fields };
        if (packed.colours) shape.colours = Float32Array.from(new Uint8Array(raw(packed.colours)), (v) => linear(v / 255));
        normalsOf(shape);
        shapes.set(i, shape);
    }
    return shape;
}

/** Shares of the shapes of a view at a place between them: cubic where there are enough, as along a component. */
export function shares(n: number, at: number, kind?: string): [number, number][] {
    const many = kind === 'mode' ? Math.min(4, n) : Math.min(2, n);
    const first = Math.max(0, Math.min(n - many, Math.floor(at) - (many >> 1) + 1));
    return Array.from({ length: many }, (_, k) => {
        let w = 1;
        for (let j = 0; j < many; j++) if (j !== k) w *= (at - first - j) / (k - j);
        return [first + k, w];
    });
}

const isP = (field: Field): boolean => /significance|fdr|pointwiseP/i.test(field.name);

function View({ view, label }: { view: ViewOf; label: string }) {
    const canvas = useRef<HTMLCanvasElement>(null);
    const all = useMemo(() => view.shapes.map(shapeAt), [view]);
    const bounds = useMemo(() => boundsOf(all), [all]);
    const [at, setAt] = useState(view.kind === 'mode' ? (all.length - 1) / 2 : 0);
    const [name, setName] = useState((all[0].fields.find((f) => f.name === 'normalEffect') ?? all[0].fields[0])?.name ?? '');
    const [threshold, setThreshold] = useState(0.05);
    const moving = useMemo(() => ({ ...all[0], positions: all[0].positions.slice(), normals: all[0].normals.slice() }), [all]);
    const field = all[0].fields.find((f) => f.name === name);
    const p = all[0].fields.find((f) => f.name === 'significance') ?? all[0].fields.find(isP);
    const map = field && { ...mapOf(field), keep: p && ((_: number, vertex: number) => p.values[vertex] <= threshold) };
    const colours = useMemo(() => {
        if (map) return paintedBy(map);
        return all[0].colours ?? Float32Array.from(all[0].positions, (_, i) => BONE[i % 3]);
    }, [all, name, threshold]);
    const paint = useRef(() => {});
    paint.current = () => canvas.current && draw(canvas.current, moving, colours, !!(map || all[0].colours), bounds.centre, bounds.radius);
    useEffect(() => {
        const watch = new ResizeObserver(() => {
            const c = canvas.current!;
            const ratio = Math.min(2, devicePixelRatio || 1);
            c.width = Math.round(c.clientWidth * ratio);
            c.height = Math.round(c.clientHeight * ratio);
            paint.current();
        });
        watch.observe(canvas.current!);
        const leave = onTurn(() => paint.current());
        return () => {
            watch.disconnect();
            leave();
        };
    }, []);
    useEffect(() => {
        moving.positions.fill(0);
        for (const [i, w] of shares(all.length, at, view.kind)) {
            const from = all[i].positions;
            for (let k = 0; k < from.length; k++) moving.positions[k] += w * from[k];
        }
        normalsOf(moving);
        paint.current();
    }, [at, colours]);
    const hold = useRef<[number, number] | null>(null);
    const here = view.texts?.[Math.round(at)];
    const KEYS: Record<string, [number, number]> = { ArrowLeft: [0, -0.15], ArrowRight: [0, 0.15], ArrowUp: [-0.15, 0], ArrowDown: [0.15, 0] };
    return (
        <>
            <canvas ref={canvas} class="view" tabIndex={0} role="img" aria-label={`${label}${here ? `, ${here}` : ''}. Drag it or use the arrows to turn it.`}
                onPointerDown={(e) => { hold.current = [e.clientX, e.clientY]; e.currentTarget.setPointerCapture(e.pointerId); }}
                onPointerUp={() => { hold.current = null; }} onPointerCancel={() => { hold.current = null; }}
                onPointerMove={(e) => {
                    if (!hold.current) return;
                    rotate((e.clientY - hold.current[1]) / 120, (e.clientX - hold.current[0]) / 120);
                    hold.current = [e.clientX, e.clientY];
                }}
                onKeyDown={(e) => {
                    if (!KEYS[e.key]) return;
                    rotate(...KEYS[e.key]);
                    e.preventDefault();
                }} />
            {all.length > 1 && (
                <label class="row">{here} <input type="range" min={0} max={all.length - 1} step={0.02} value={at} aria-label={`${label}: where along it`} onInput={(e) => setAt(+e.currentTarget.value)} /></label>
            )}
            {all[0].fields.length > 0 && (
                <div class="row">
                    <label>Map <select value={name} onChange={(e) => setName(e.currentTarget.value)}>
                        <option value="">none</option>{all[0].fields.map((f) => <option value={f.name}>{f.name}</option>)}
                    </select></label>
                    {p && map && <label>grey where p exceeds <input type="number" min={0} max={1} step={0.01} value={threshold} onInput={(e) => setThreshold(+e.currentTarget.value)} /></label>}
                </div>
            )}
            {map && <ColourBar map={map} threshold={field === p ? threshold : undefined} />}
            {field?.meaning && <p class="quiet">{field.meaning}</p>}
            {p && map && p.low > threshold && <p role="status">No point is significant: the least p is {figure(p.low)}.</p>}
            <button class="quiet" onClick={() => canvas.current!.toBlob((blob) => blob && save('shape.png', blob))} aria-label={`${label} as PNG`}>PNG</button>
        </>
    );
}

function start(): void {
    try {
        data = JSON.parse(document.getElementById('data')!.textContent!);
    } catch {
        return; // the frame alone, not filled
    }
    if (data.turn) turnTo(data.turn);
    else rotate(-1.2, 0.5);
    for (const node of document.querySelectorAll<HTMLElement>('[data-section]')) {
        const { results } = data.sections[Number(node.dataset.section)];
        try {
            render(<Findings result={results} />, node);
        } catch (error) {
            console.error(error); // the tables still say it
        }
    }
    // What is wider than the page is scrolled, by keys too.
    for (const table of document.querySelectorAll('table')) if (table.scrollWidth > table.clientWidth) table.tabIndex = 0;
    if (!able) return;
    for (const node of document.querySelectorAll<HTMLElement>('[data-view]')) {
        const label = node.querySelector('figcaption')?.textContent ?? node.querySelector('img')?.alt ?? '';
        const place = document.createElement('div');
        const picture = node.querySelector('img');
        if (picture) picture.replaceWith(place);
        else node.prepend(place);
        render(<View view={data.views[Number(node.dataset.view)]} label={label} />, place);
    }
}

start();
