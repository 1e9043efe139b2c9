// Charts as SVG of our own, so that what is taken away is what is seen. Each has its figures as a table too.
import type { ComponentChildren } from 'preact';
import { useMemo, useRef, useState } from 'preact/hooks';
import { colourAt, colourText, groupLook } from './colours';
import { t } from './i18n';
import { csv, figure, save } from './text';

export type Rows = (string | number | null)[][];

/** The chart alone as a file: dark on light, whatever the page is. */
export function svgText(node: SVGElement): string {
    const copy = node.cloneNode(true) as SVGElement;
    const [, , width, height] = (node.getAttribute('viewBox') ?? '0 0 400 300').split(/\s+/);
    copy.setAttribute('xmlns', 'http://www.w3.org/2000/svg');
    copy.setAttribute('width', width);
    copy.setAttribute('height', height);
    copy.setAttribute('color', '#222222');
    copy.setAttribute('font-family', 'Helvetica, Arial, sans-serif');
    for (const inner of copy.querySelectorAll('[tabindex]')) inner.removeAttribute('tabindex');
    return new XMLSerializer().serializeToString(copy);
}

export async function svgPicture(node: SVGElement, scale = 4): Promise<Blob> {
    const image = new Image();
    image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svgText(node))}`;
    await image.decode();
    const canvas = document.createElement('canvas');
    canvas.width = image.width * scale;
    canvas.height = image.height * scale;
    const pen = canvas.getContext('2d')!;
    pen.fillStyle = '#ffffff';
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.drawImage(image, 0, 0, canvas.width, canvas.height);
    return new Promise((yes) => canvas.toBlob((blob) => yes(blob!), 'image/png'));
}

export function Chart({ title, name, rows, children }: { title: string; name: string; rows?: Rows; children: ComponentChildren }) {
    const box = useRef<HTMLElement>(null);
    const svg = () => box.current!.querySelector<SVGElement>('svg')!;
    return (
        <figure class="chart" ref={box}>
            <figcaption>{title}</figcaption>
            {children}
            <div class="actions no-report">
                <button onClick={() => save(`${name}.svg`, svgText(svg()), 'image/svg+xml')} aria-label={t`${title} as SVG`}>{t`SVG`}</button>
                <button onClick={async () => save(`${name}.png`, await svgPicture(svg()))} aria-label={t`${title} as PNG`}>{t`PNG`}</button>
                {rows && <button onClick={() => save(`${name}.csv`, csv(rows), 'text/csv;charset=utf-8')} aria-label={t`${title} as CSV`}>{t`CSV`}</button>}
            </div>
            {rows && rows.length <= 400 && (
                <details class="no-report"><summary>{t`As a table`}</summary><DataTable rows={rows} /></details>
            )}
        </figure>
    );
}

export function DataTable({ rows }: { rows: Rows }) {
    const [head, ...body] = rows;
    return (
        <div class="scroll" tabIndex={0} role="region" aria-label={t`Table: ${head.filter((c) => c !== null && c !== '').slice(0, 6).join(', ')}`}>
            <table><thead><tr>{head.map((c) => <th scope="col">{c}</th>)}</tr></thead>
                <tbody>{body.map((r) => <tr>{r.map((c) => <td>{typeof c === 'number' ? figure(c, 4) : c}</td>)}</tr>)}</tbody></table>
        </div>
    );
}

// ---- Axes ------------------------------------------------------------------------------------------------------------

/** Round numbers that cover a range. */
export function ticks(low: number, high: number, about = 5): number[] {
    if (!(high > low)) return [low];
    const rough = (high - low) / about;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough)!;
    const list: number[] = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) list.push(+(i * step).toPrecision(12));
    return list;
}

export function Axes({ x, y, box, labels }: {
    x: [number, number]; y: [number, number]; box: [number, number, number, number]; labels: [string, string];
}) {
    const [left, top, right, bottom] = box;
    const at = (v: number, [a, b]: [number, number], p: number, q: number) => p + ((v - a) / (b - a)) * (q - p);
    return (
        <g font-size="11" fill="currentColor" stroke="none">
            {ticks(...x).map((v) => (
                <g><path d={`M${at(v, x, left, right)} ${bottom}V${top}`} stroke="currentColor" stroke-opacity=".15" />
                    <text x={at(v, x, left, right)} y={bottom + 15} text-anchor="middle">{figure(v)}</text></g>
            ))}
            {ticks(...y).map((v) => (
                <g><path d={`M${left} ${at(v, y, bottom, top)}H${right}`} stroke="currentColor" stroke-opacity=".15" />
                    <text x={left - 5} y={at(v, y, bottom, top) + 4} text-anchor="end">{figure(v)}</text></g>
            ))}
            <text x={(left + right) / 2} y={bottom + 31} text-anchor="middle">{labels[0]}</text>
            <text transform={`translate(${left - 42} ${(top + bottom) / 2}) rotate(-90)`} text-anchor="middle">{labels[1]}</text>
        </g>
    );
}

export const padded = (values: number[]): [number, number] => {
    const low = Math.min(...values);
    const high = Math.max(...values);
    const margin = (high - low || 1) * 0.08;
    return [low - margin, high + margin];
};

// ---- Scatter ---------------------------------------------------------------------------------------------------------

export interface Dot { x: number; y: number; name: string; group?: string | null }

export const LEGEND_COLUMNS = 4;
const LEGEND_MAX = 2 * LEGEND_COLUMNS;

/** Marks of groups, below a chart: two lines of them, and of long names the beginning. */
export function Legend({ groups }: { groups: string[] }) {
    const shown = groups.length > LEGEND_MAX ? groups.slice(0, LEGEND_MAX - 1) : groups;
    const place = (i: number) => `translate(${70 + 88 * (i % LEGEND_COLUMNS)} ${342 + 16 * Math.floor(i / LEGEND_COLUMNS)})`;
    return (
        <>
            {shown.map((g, i) => {
                const { colour, path } = groupLook(groups, g);
                return <g transform={place(i)}><title>{g}</title><path d={path} fill={colour} /><text x="10" y="4" font-size="11" fill="currentColor">{g.length > 12 ? `${g.slice(0, 11)}…` : g}</text></g>;
            })}
            {groups.length > shown.length && <text transform={place(shown.length)} y="4" font-size="11" fill="currentColor">{t`and ${groups.length - shown.length} more`}</text>}
        </>
    );
}

export function Scatter({ title, name, dots, labels, chosen, onChoose, equal }: {
    title: string; name: string; dots: Dot[]; labels: [string, string]; chosen?: number; onChoose?: (i: number) => void; equal?: boolean;
}) {
    const groups = [...new Set(dots.map((d) => d.group).filter((g): g is string => !!g))];
    let x = padded(dots.map((d) => d.x));
    let y = padded(dots.map((d) => d.y));
    if (equal) {
        const half = Math.max((x[1] - x[0]) / 350, (y[1] - y[0]) / 270) / 2;
        x = [(x[0] + x[1]) / 2 - half * 350, (x[0] + x[1]) / 2 + half * 350];
        y = [(y[0] + y[1]) / 2 - half * 270, (y[0] + y[1]) / 2 + half * 270];
    }
    const px = (v: number) => 60 + ((v - x[0]) / (x[1] - x[0])) * 350;
    const py = (v: number) => 290 - ((v - y[0]) / (y[1] - y[0])) * 270;
    return (
        <Chart title={title} name={name} rows={[[t`name`, t`group`, ...labels], ...dots.map((d) => [d.name, d.group ?? '', d.x, d.y] as Rows[0])]}>
            <svg viewBox={`0 0 420 ${groups.length > LEGEND_COLUMNS ? 366 : 350}`} role="group" aria-label={t`${title}: ${dots.length} shapes${onChoose ? t`; Enter on one shows it` : ''}`}>
                <Axes x={x} y={y} box={[60, 20, 410, 290]} labels={labels} />
                {dots.map((d, i) => {
                    const { colour, path } = groupLook(groups, d.group);
                    return (
                        <g key={i} transform={`translate(${px(d.x).toFixed(1)} ${py(d.y).toFixed(1)})`} class={onChoose ? 'dot' : ''}
                            {...(onChoose ? { tabindex: 0, role: 'button', 'aria-pressed': chosen === i, 'aria-label': `${d.name}${d.group ? `, ${d.group}` : ''}: ${figure(d.x)}, ${figure(d.y)}`, onClick: () => onChoose(i), onKeyDown: (e: KeyboardEvent) => { if (e.key === 'Enter' || e.key === ' ') { onChoose(i); e.preventDefault(); } } } : {})}>
                            <title>{d.name}{d.group ? ` (${d.group})` : ''}</title>
                            <circle r="12" fill="transparent" />
                            {chosen === i && <circle r="9" fill="none" stroke="currentColor" stroke-width="2" />}
                            <path d={path} fill={colour} stroke="#ffffff" stroke-width=".7" />
                        </g>
                    );
                })}
                <Legend groups={groups} />
            </svg>
        </Chart>
    );
}

const SPREAD_MANY = 40; // marks, which are small from there on

/** Where the members are along one axis from -3 to 3, a line for each group; those beyond stand at its ends. */
export function Spread({ title, values, at, width = 3 }: { title: string; values: { value: number; name: string; group?: string | null }[]; at: number; width?: number }) {
    const groups = [...new Set(values.map((v) => v.group).filter((g): g is string => !!g))];
    const lines = groups.length ? groups : [null];
    const x = (v: number) => 8 + ((Math.max(-width, Math.min(width, v)) + width) / (2 * width)) * 304;
    const mean = (list: number[]) => list.reduce((a, b) => a + b, 0) / list.length;
    const said = lines.map((g) => {
        const own = values.filter((v) => !g || v.group === g).map((v) => v.value);
        return t`${g ? `${g}: ` : ''}mean ${figure(mean(own), 2)}, from ${figure(Math.min(...own), 2)} to ${figure(Math.max(...own), 2)}`;
    });
    return (
        <svg class="spread" viewBox={`0 0 320 ${14 * lines.length + 4}`} role="img" aria-label={`${title}. ${said.join('; ')}`}>
            <path d={`M${x(at)} 0V${14 * lines.length + 4}`} stroke="currentColor" stroke-width="1" />
            {lines.map((_, i) => <path d={`M8 ${9 + 14 * i}H312`} stroke="currentColor" stroke-opacity=".2" />)}
            {values.map((v) => {
                const { colour, path } = groupLook(groups, v.group);
                return <path transform={`translate(${x(v.value).toFixed(1)} ${9 + 14 * Math.max(0, groups.indexOf(v.group ?? ''))})${values.length > SPREAD_MANY ? ' scale(.6)' : ''}`} d={path} fill={colour} fill-opacity=".8"><title>{`${v.name}${v.group ? ` (${v.group})` : ''}: ${figure(v.value)}`}</title></path>;
            })}
        </svg>
    );
}

// ---- Bars, lines, intervals ----------------------------------------------------------------------------------------

export function Variance({ explained, cumulative }: { explained: (number | null)[]; cumulative: (number | null)[] }) {
    const n = Math.min(explained.length, 20);
    const width = 340 / n;
    return (
        <Chart title={t`Variance of the components`} name="variance" rows={[[t`component`, t`explained`, t`cumulative`], ...explained.map((e, i) => [i + 1, e, cumulative[i]])]}>
            <svg viewBox="0 0 420 350" role="img" aria-label={t`Variance explained: ${explained.slice(0, 5).map((e, i) => t`component ${i + 1} ${Math.round(100 * (e ?? 0))} %`).join(', ')}`}>
                <Axes x={[0.5, n + 0.5]} y={[0, 1]} box={[60, 20, 410, 290]} labels={[t`component`, t`share of the variance`]} />
                {explained.slice(0, n).map((e, i) => <rect x={65 + i * width} y={290 - 270 * (e ?? 0)} width={width * 0.7} height={270 * (e ?? 0)} fill="#0072b2" />)}
                <path d={`M${cumulative.slice(0, n).map((c, i) => `${65 + (i + 0.35) * width} ${290 - 270 * (c ?? 0)}`).join('L')}`} fill="none" stroke="#d55e00" stroke-width="2" />
                <text x="235" y="338" font-size="11" text-anchor="middle" fill="currentColor">{t`bars: each; line: all so far`}</text>
            </svg>
        </Chart>
    );
}

export function Curve({ title, name, points, labels }: { title: string; name: string; points: { x: number; y: number; error?: number | null }[]; labels: [string, string] }) {
    const x = padded(points.map((p) => p.x));
    const y = padded(points.flatMap((p) => [p.y - (p.error ?? 0), p.y + (p.error ?? 0), 0]));
    const px = (v: number) => 60 + ((v - x[0]) / (x[1] - x[0])) * 350;
    const py = (v: number) => 290 - ((v - y[0]) / (y[1] - y[0])) * 270;
    return (
        <Chart title={title} name={name} rows={[[labels[0], labels[1], t`standard error`], ...points.map((p) => [p.x, p.y, p.error ?? null])]}>
            <svg viewBox="0 0 420 350" role="img" aria-label={t`${title}: from ${figure(points[0]?.y)} to ${figure(points.at(-1)?.y)}`}>
                <Axes x={x} y={y} box={[60, 20, 410, 290]} labels={labels} />
                <path d={`M${points.map((p) => `${px(p.x)} ${py(p.y)}`).join('L')}`} fill="none" stroke="#0072b2" stroke-width="2" />
                {points.map((p) => <>{p.error ? <path d={`M${px(p.x)} ${py(p.y - p.error)}V${py(p.y + p.error)}`} stroke="currentColor" /> : null}<circle cx={px(p.x)} cy={py(p.y)} r="3" fill="#0072b2" /></>)}
            </svg>
        </Chart>
    );
}

export function Intervals({ rows, chance, title = 'Accuracy', name = 'accuracy', heading = 'method' }: {
    rows: { name: string; value: number; low: number; high: number; p?: number | null }[]; chance: number; title?: string; name?: string; heading?: string;
}) {
    const height = 50 + 30 * rows.length;
    const at = (v: number) => 130 + 260 * v;
    return (
        <Chart title={t`${title}, with 95 % intervals`} name={name} rows={[[heading, t`accuracy`, t`low`, t`high`, 'p'], ...rows.map((r) => [r.name, r.value, r.low, r.high, r.p ?? null])]}>
            <svg viewBox={`0 0 420 ${height}`} role="img" aria-label={rows.map((r) => t`${r.name}: ${figure(r.value, 2)}, ${figure(r.low, 2)} to ${figure(r.high, 2)}`).join('; ')}>
                {[0, 0.25, 0.5, 0.75, 1].map((v) => <><path d={`M${at(v)} 10V${height - 30}`} stroke="currentColor" stroke-opacity=".15" /><text x={at(v)} y={height - 14} font-size="11" text-anchor="middle" fill="currentColor">{v}</text></>)}
                <path d={`M${at(chance)} 10V${height - 30}`} stroke="#d55e00" stroke-dasharray="4 3" />
                <text x={at(chance)} y={height - 2} font-size="10" text-anchor="middle" fill="currentColor">{t`by chance`}</text>
                {rows.map((r, i) => (
                    <g transform={`translate(0 ${25 + 30 * i})`}>
                        <text x="8" y="4" font-size="12" fill="currentColor">{r.name}</text>
                        <path d={`M${at(r.low)} 0H${at(r.high)}M${at(r.low)} -5V5M${at(r.high)} -5V5`} stroke="currentColor" fill="none" />
                        <circle cx={at(r.value)} cy="0" r="5" fill="#0072b2" />
                    </g>
                ))}
            </svg>
        </Chart>
    );
}

export function Confusion({ classes, counts, title }: { classes: string[]; counts: number[][]; title: string }) {
    const n = classes.length;
    const side = Math.min(60, 240 / n);
    const most = Math.max(1, ...counts.flat());
    return (
        <Chart title={title} name="confusion" rows={[[t`is`, ...classes.map((c) => t`taken for ${c}`)], ...counts.map((r, i) => [classes[i], ...r])]}>
            <svg class="narrow" viewBox={`0 0 ${130 + side * n} ${60 + side * n}`} role="img" aria-label={counts.map((r, i) => `${classes[i]}: ${r.map((v, k) => t`${v} taken for ${classes[k]}`).join(', ')}`).join('; ')}>
                {counts.map((row, i) => row.map((v, k) => (
                    <g><rect x={120 + k * side} y={40 + i * side} width={side - 1} height={side - 1} fill={i === k ? '#0072b2' : '#d55e00'} fill-opacity={0.12 + 0.88 * (v / most)} />
                        <text x={120 + (k + 0.5) * side} y={44 + (i + 0.5) * side} text-anchor="middle" font-size="13" fill={v / most > 0.5 ? '#ffffff' : 'currentColor'}>{v}</text></g>
                )))}
                {classes.map((c, i) => <><text x="114" y={44 + (i + 0.5) * side} text-anchor="end" font-size="12" fill="currentColor">{c}</text>
                    <text x={120 + (i + 0.5) * side} y="34" text-anchor="middle" font-size="12" fill="currentColor">{c}</text></>)}
                <text x="120" y="14" font-size="11" fill="currentColor">{t`taken for`}</text>
                <text x="114" y="34" font-size="11" text-anchor="end" fill="currentColor">{t`is`}</text>
            </svg>
        </Chart>
    );
}

// ---- Distances -------------------------------------------------------------------------------------------------------

interface Tree { at: number; height: number; leaves: number[]; left?: Tree; right?: Tree }

/** Average linkage (UPGMA): the order of the leaves and the tree. */
export function cluster(matrix: number[][]): Tree {
    const d = matrix.map((row) => Float64Array.from(row));
    const nodes: Tree[] = matrix.map((_, i) => ({ at: i, height: 0, leaves: [i] }));
    let open = nodes.map((_, i) => i);
    const nearest = (i: number): number => open.reduce((best, j) => (j !== i && (best < 0 || d[i][j] < d[i][best]) ? j : best), -1);
    const near = open.map(nearest);
    while (open.length > 1) {
        const i = open.reduce((best, k) => (d[k][near[k]] < d[best][near[best]] ? k : best));
        const j = near[i];
        const [left, right] = [nodes[i], nodes[j]];
        const [p, q] = [left.leaves.length, right.leaves.length];
        nodes[i] = { at: -1, height: d[i][j], left, right, leaves: [...left.leaves, ...right.leaves] };
        open = open.filter((k) => k !== j);
        for (const k of open) if (k !== i) d[i][k] = d[k][i] = (p * d[i][k] + q * d[j][k]) / (p + q);
        // What was joined is no nearer to others than one of its parts was: only these look anew.
        for (const k of open) if (k === i || near[k] === i || near[k] === j) near[k] = nearest(k);
    }
    return nodes[open[0]];
}

/** Classical scaling: the first two coordinates, by power iteration on the doubly centred squares. */
export function scaling(matrix: number[][]): { points: [number, number][]; share: number } {
    const n = matrix.length;
    const square = matrix.map((r) => Float64Array.from(r, (d) => d * d));
    const mean = square.map((r) => r.reduce((a, b) => a + b, 0) / n);
    const all = mean.reduce((a, b) => a + b, 0) / n;
    const b = square.map((r, i) => r.map((d, j) => -0.5 * (d - mean[i] - mean[j] + all)));
    const trace = b.reduce((sum, r, i) => sum + Math.max(0, r[i]), 0);
    const dot = (v: Float64Array, w: Float64Array): number => {
        let sum = 0;
        for (let i = 0; i < n; i++) sum += v[i] * w[i];
        return sum;
    };
    const vectors: { value: number; vector: Float64Array }[] = [];
    for (let k = 0; k < 2; k++) {
        let v = Float64Array.from({ length: n }, (_, i) => Math.sin(1 + i * (k + 1.7)));
        let value = 0;
        for (let round = 0; round < 300; round++) {
            for (const e of vectors) {
                const along = dot(v, e.vector);
                v = v.map((x, i) => x - along * e.vector[i]);
            }
            const w = Float64Array.from(b, (r) => dot(r, v));
            value = Math.sqrt(dot(w, w));
            if (value === 0) break;
            v = w.map((x) => x / value);
        }
        vectors.push({ value, vector: v });
    }
    const points = Array.from({ length: n }, (_, i) => vectors.map((e) => e.vector[i] * Math.sqrt(Math.max(0, e.value))) as [number, number]);
    return { points, share: trace > 0 ? (vectors[0].value + vectors[1].value) / trace : 0 };
}

const CELLS_MAX = 64; // on a side: of more, the cells are one picture

/** Cells as a picture of one pixel each. */
function cellPicture(order: number[], matrix: number[][], most: number): string {
    const n = order.length;
    const canvas = document.createElement('canvas');
    canvas.width = canvas.height = n;
    const pen = canvas.getContext('2d')!;
    const pixels = pen.createImageData(n, n);
    order.forEach((i, row) => order.forEach((j, column) => {
        pixels.data.set([...colourAt('cividis', matrix[i][j] / most).map((c) => Math.round(255 * c)), 255], 4 * (row * n + column));
    }));
    pen.putImageData(pixels, 0, 0);
    return canvas.toDataURL('image/png');
}

/** A tree as paths: all of it, and the way from one leaf to the root. */
function treePaths(tree: Tree, chosen: number | undefined, x: (leaf: number) => number): [all: string, way: string] {
    const lines: string[] = [];
    const way: string[] = [];
    const y = (height: number) => 55 - 50 * (height / (tree.height || 1));
    const walk = (node: Tree): number => {
        if (!node.left || !node.right) return x(node.at);
        const [a, b] = [walk(node.left), walk(node.right)];
        lines.push(`M${a} ${y(node.left.height)}V${y(node.height)}H${b}V${y(node.right.height)}`);
        const middle = (a + b) / 2;
        if (chosen !== undefined && node.leaves.includes(chosen)) {
            const [at, below] = node.left.leaves.includes(chosen) ? [a, node.left] : [b, node.right];
            way.push(`M${at} ${y(below.height)}V${y(node.height)}H${middle}`);
        }
        return middle;
    };
    walk(tree);
    return [lines.join(''), way.join('')];
}

export function HeatMap({ labels, matrix, chosen, onChoose }: { labels: string[]; matrix: number[][]; chosen?: number; onChoose: (i: number) => void }) {
    const n = labels.length;
    const side = 300 / n;
    const [here, setHere] = useState('');
    const { tree, most, place, cells } = useMemo(() => {
        const tree = cluster(matrix);
        const most = matrix.reduce((high, row) => row.reduce((a, b) => Math.max(a, b), high), 0) || 1;
        const cells = n > CELLS_MAX
            ? <image x="10" y="60" width="300" height="300" preserveAspectRatio="none" image-rendering="pixelated" href={cellPicture(tree.leaves, matrix, most)} />
            : tree.leaves.map((i, row) => tree.leaves.map((j, column) => <rect x={10 + column * side} y={60 + row * side} width={side} height={side} fill={colourText('cividis', matrix[i][j] / most)} />));
        return { tree, most, place: new Map(tree.leaves.map((leaf, i) => [leaf, i])), cells };
    }, [matrix]);
    const [lines, way] = useMemo(() => treePaths(tree, chosen, (leaf) => 10 + (place.get(leaf)! + 0.5) * side), [tree, chosen]);
    const under = (e: MouseEvent): [number, number] => {
        const box = (e.currentTarget as SVGElement).getBoundingClientRect();
        const leaf = (part: number) => tree.leaves[Math.max(0, Math.min(n - 1, Math.floor(part * n)))];
        return [leaf((e.clientY - box.top) / box.height), leaf((e.clientX - box.left) / box.width)];
    };
    const row = chosen === undefined ? undefined : place.get(chosen);
    return (
        <Chart title={t`Distances, in the order of the tree`} name="distances" rows={[['', ...labels], ...matrix.map((r, i) => [labels[i], ...r])]}>
            <svg viewBox="0 0 480 400" role="group" aria-label={t`Distances between ${n} shapes; the greatest is ${figure(most)}`}>
                <path d={lines} fill="none" stroke="currentColor" stroke-width={n > CELLS_MAX ? 0.5 : 1} />
                {cells}
                {row !== undefined && <path d={`${way}M10 ${60 + row * side}h300v${side}h-300ZM${10 + row * side} 60h${side}v300h${-side}Z`} fill="none" stroke="#d55e00" stroke-width="1.5" />}
                <rect class="dot" x="10" y="60" width="300" height="300" fill="transparent" onPointerLeave={() => setHere('')}
                    onClick={(e) => { const [i, j] = under(e); onChoose(i === chosen ? j : i); }}
                    onPointerMove={(e) => { const [i, j] = under(e); setHere(t`${labels[i]} and ${labels[j]}: ${figure(matrix[i][j])}`); }} />
                {n <= CELLS_MAX ? tree.leaves.map((i, at) => (
                    <text x="316" y={60 + (at + 0.5) * side + 4} font-size={Math.min(11, side)} fill="currentColor" class="dot" font-weight={chosen === i ? 'bold' : 'normal'} tabindex={0} role="button" aria-pressed={chosen === i}
                        onClick={() => onChoose(i)} onKeyDown={(e) => { if (e.key === 'Enter') onChoose(i); }}>{labels[i].slice(0, 26)}</text>
                )) : row !== undefined && <text x="316" y={Math.min(360, 64 + (row + 0.5) * side)} font-size="11" fill="currentColor">{labels[chosen!].slice(0, 26)}</text>}
                {Array.from({ length: 20 }, (_, i) => <rect x={10 + 15 * i} y="372" width="15" height="9" fill={colourText('cividis', i / 19)} />)}
                <text x="10" y="394" font-size="11" fill="currentColor">0</text><text x="310" y="394" font-size="11" text-anchor="end" fill="currentColor">{figure(most)}</text>
                {here && <text x="160" y="394" font-size="11" text-anchor="middle" fill="currentColor">{here.slice(0, 44)}</text>}
            </svg>
        </Chart>
    );
}

// ---- Probabilities ---------------------------------------------------------------------------------------------------

interface Bin { members: number; meanProbability: number | null; observed: number | null; interval: [number | null, number | null] }

/** What was said against what was so, with intervals; on the line both agree. */
export function Reliability({ title, name, bins }: { title: string; name: string; bins: Bin[] }) {
    const seen = bins.filter((b) => typeof b.meanProbability === 'number' && typeof b.observed === 'number');
    const px = (v: number) => 60 + v * 270;
    const py = (v: number) => 290 - v * 270;
    return (
        <Chart title={title} name={name} rows={[[t`said`, t`so`, t`low`, t`high`, t`members`], ...seen.map((b) => [b.meanProbability, b.observed, b.interval?.[0] ?? null, b.interval?.[1] ?? null, b.members])]}>
            <svg viewBox="0 0 420 350" role="img" aria-label={`${title}. ${seen.map((b) => t`said ${figure(b.meanProbability, 2)}, so ${figure(b.observed, 2)} of ${b.members}`).join('; ')}`}>
                <Axes x={[0, 1]} y={[0, 1]} box={[60, 20, 330, 290]} labels={[t`probability that was said`, t`share that was so`]} />
                <path d={`M${px(0)} ${py(0)}L${px(1)} ${py(1)}`} stroke="currentColor" stroke-dasharray="4 3" stroke-opacity=".6" />
                {seen.map((b) => (
                    <g>
                        {typeof b.interval?.[0] === 'number' && <path d={`M${px(b.meanProbability!)} ${py(b.interval[0]!)}V${py(b.interval[1]!)}`} stroke="currentColor" />}
                        <circle cx={px(b.meanProbability!)} cy={py(b.observed!)} r={3 + Math.min(6, Math.sqrt(b.members))} fill="#0072b2" fill-opacity=".8"><title>{t`${b.members} members`}</title></circle>
                    </g>
                ))}
            </svg>
        </Chart>
    );
}
