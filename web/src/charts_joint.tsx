// Charts of several structures together, of neighbours, landmarks and percentiles.
import { Axes, Chart, DataTable, Scatter, Variance } from './charts';
import { GROUPS } from './colours';
import { t } from './i18n';
import { figure } from './text';

// ---- Several structures ----------------------------------------------------------------------------------------------

export const isJoint = (result: any): boolean => Array.isArray(result.parts) && Array.isArray(result.shares) && Array.isArray(result.eigenvalues);

const SHOWN = 10;

/** What of each component is of each structure, one bar for each component. */
export function Shares({ names, shares }: { names: string[]; shares: number[][] }) {
    const rows = shares.slice(0, SHOWN);
    const height = 30 + 24 * rows.length;
    const colour = (p: number) => GROUPS[p % GROUPS.length];
    return (
        <Chart title={t`Whose variance each component is`} name="shares" rows={[[t`component`, ...names], ...shares.map((row, k) => [k + 1, ...row])]}>
            <svg viewBox={`0 0 420 ${height + 18 * Math.ceil(names.length / 3)}`} role="img" aria-label={rows.map((row, k) => t`component ${k + 1}: ${row.map((v, p) => `${names[p]} ${Math.round(100 * v)} %`).join(', ')}`).join('; ')}>
                {rows.map((row, k) => {
                    let left = 40;
                    return (
                        <g transform={`translate(0 ${10 + 24 * k})`}>
                            <text x="30" y="13" font-size="11" text-anchor="end" fill="currentColor">{k + 1}</text>
                            {row.map((v, p) => {
                                const x = left;
                                left += 370 * v;
                                return <rect x={x} y="0" width={Math.max(0, 370 * v - 0.5)} height="18" fill={colour(p)}><title>{`${names[p]}: ${figure(100 * v)} %`}</title></rect>;
                            })}
                        </g>
                    );
                })}
                {names.map((name, p) => (
                    <g transform={`translate(${40 + 125 * (p % 3)} ${height + 18 * Math.floor(p / 3)})`}><rect y="-9" width="10" height="10" fill={colour(p)} /><text x="15" font-size="11" fill="currentColor">{name.length > 14 ? `${name.slice(0, 13)}…` : name}</text></g>
                ))}
            </svg>
        </Chart>
    );
}

/** Parts that components have shares of: the structures, and where they are. */
export const sharers = (result: any): string[] => [...result.parts.map((p: any) => p.name), ...(result.positions ? ['positions'] : [])];

export function JointCharts({ result, chosen, onChoose }: { result: any; chosen?: number; onChoose?: (i: number) => void }) {
    const second = Math.min(1, result.eigenvalues.length - 1);
    const sd = (k: number) => Math.sqrt(result.eigenvalues[k]) || 1;
    const names = sharers(result);
    const dots = result.scores.map((s: number[], i: number) => ({ x: s[0] / sd(0), y: s[second] / sd(second), name: result.subjects?.[i] ?? `${i + 1}`, group: result.groups?.[i] }));
    return (
        <>
            <Scatter title={t`Scores of the subjects`} name="scores" dots={dots} labels={[t`component 1 (sd)`, t`component ${second + 1} (sd)`]} chosen={chosen} onChoose={onChoose} />
            {result.shares && <Shares names={names} shares={result.shares.map((row: number[]) => row.slice(0, names.length))} />}
            <Variance explained={result.explained} cumulative={result.cumulative} />
        </>
    );
}

// ---- Neighbours ------------------------------------------------------------------------------------------------------

export const isNeighbours = (result: any): boolean => Array.isArray(result.indices?.[0]) && Array.isArray(result.distances?.[0]);

const PRESSED_MAX = 400; // marks that can have the focus
const LISTED_MAX = 500;

export const nameAt = (result: any, i: number): string => result.labels?.[i] ?? `${i + 1}`;

/** How many of the nearest have the same label, for each label. */
export function agreement(result: any): (string | number)[][] {
    const groups: (string | null)[] = result.groups ?? [];
    const labels = [...new Set(groups.filter((g): g is string => !!g))];
    return labels.map((label) => {
        const near = result.indices.flatMap((row: number[], i: number) => (groups[i] === label ? row.map((j) => groups[j]) : []));
        const others = groups.filter((g) => g === label).length - 1;
        return [label, near.filter((g: string) => g === label).length / (near.length || 1), others / Math.max(1, groups.length - 1)];
    });
}

export function NeighbourCharts({ result, chosen, onChoose }: { result: any; chosen?: number; onChoose?: (i: number) => void }) {
    const order: number[] = result.indices.map((_: unknown, i: number) => i).sort((a: number, b: number) => result.distances[a][0] - result.distances[b][0]);
    const dots = order.map((i, rank) => ({ x: rank + 1, y: result.distances[i][0], name: nameAt(result, i), group: result.groups?.[i] }));
    const rows = agreement(result);
    return (
        <>
            <Scatter title={t`How far each member's nearest is`} name="nearest" dots={dots} labels={[t`members, in this order`, t`distance to the nearest`]}
                chosen={chosen === undefined ? undefined : order.indexOf(chosen)} onChoose={onChoose && dots.length <= PRESSED_MAX ? (rank) => onChoose(order[rank]) : undefined} />
            {rows.length > 1 && <div><p>{t`How many of the nearest have the same label:`}</p><DataTable rows={[[t`label`, t`share of the nearest with it`, t`by chance`], ...rows]} /></div>}
        </>
    );
}

export const neighbourRows = (result: any): (string | number)[][] => [
    ['member', ...result.indices[0].slice(0, 5).map((_: unknown, k: number) => (k === 0 ? 'nearest' : `${k + 1}th`))],
    ...result.indices.slice(0, LISTED_MAX).map((row: number[], i: number) => [nameAt(result, i), ...row.slice(0, 5).map((j, k) => `${nameAt(result, j)} (${figure(result.distances[i][k])})`)]),
];

// ---- Landmarks -------------------------------------------------------------------------------------------------------

/** What a registration leaves between landmarks; those that did not guide it are rings. */
export function LandmarkChart({ points, names }: { points: { distance: number | null; angle: number | null; heldOut: boolean }[]; names?: string[] }) {
    const most = Math.max(...points.map((p) => p.distance ?? 0)) || 1e-12;
    const height = 46 + 20 * points.length;
    const name = (i: number) => names?.[i] ?? t`landmark ${i + 1}`;
    const at = (v: number) => 130 + (270 * v) / most;
    return (
        <Chart title={t`Distance that is left at each landmark`} name="landmarks" rows={[[t`landmark`, t`held out`, t`distance`, t`angle`], ...points.map((p, i) => [name(i), p.heldOut ? t`yes` : t`no`, p.distance, p.angle])]}>
            <svg viewBox={`0 0 420 ${height}`} role="img" aria-label={points.map((p, i) => `${name(i)}${p.heldOut ? t`, held out` : ''}: ${figure(p.distance)}`).join('; ')}>
                {points.map((p, i) => (
                    <g transform={`translate(0 ${16 + 20 * i})`}>
                        <text x="120" y="4" font-size="11" text-anchor="end" fill="currentColor">{name(i)}</text>
                        <path d={`M130 0H${at(p.distance ?? 0)}`} stroke={p.heldOut ? '#d55e00' : '#0072b2'} stroke-width="4" />
                        <circle cx={at(p.distance ?? 0)} cy="0" r="5" fill={p.heldOut ? 'none' : '#0072b2'} stroke={p.heldOut ? '#d55e00' : 'none'} stroke-width="2" />
                    </g>
                ))}
                <text x="130" y={height - 20} font-size="11" fill="currentColor">0</text>
                <text x="400" y={height - 20} font-size="11" text-anchor="end" fill="currentColor">{figure(most)}</text>
                <text x="265" y={height - 6} font-size="11" text-anchor="middle" fill="currentColor">{t`in the units of the moving surface; rings: held out`}</text>
            </svg>
        </Chart>
    );
}

// ---- Percentiles -----------------------------------------------------------------------------------------------------

const KOLMOGOROV = 1.358; // of the 95 % limit of the distance, times the root of how many there are

/** Percentiles of members that were left out, against uniform ones, with where 95 % of right ones stay. */
export function Percentiles({ checks }: { checks: { name: string; percentiles: number[]; distance?: number; pValue?: number }[] }) {
    const n = checks[0].percentiles.length;
    const band = (100 * KOLMOGOROV) / Math.sqrt(n);
    const at = (x: number, y: number) => `${(60 + 3.5 * x).toFixed(1)} ${(290 - 2.7 * Math.max(0, Math.min(100, y))).toFixed(1)}`;
    const sorted = checks.map((c) => ({ ...c, found: [...c.percentiles].sort((a, b) => a - b).map((y, i): [number, number] => [(100 * (i + 0.5)) / n, y]) }));
    const edge = (sign: number) => Array.from({ length: 51 }, (_, i) => at(2 * i, 2 * i + sign * band));
    return (
        <Chart title={t`Percentiles of members left out: on the diagonal if they are what they say`} name="percentiles"
            rows={[[t`expected`, ...sorted.map((c) => c.name)], ...sorted[0].found.map(([x], i) => [x, ...sorted.map((c) => c.found[i][1])])]}>
            <svg viewBox="0 0 420 366" role="img" aria-label={t`Percentiles of ${n} members that were left out. ${sorted.map((c) => t`${c.name}: differs from uniform by ${figure(c.distance)}, p ${figure(c.pValue)}`).join('; ')}`}>
                <path d={`M${edge(1).join('L')}L${edge(-1).reverse().join('L')}Z`} fill="currentColor" fill-opacity=".08" />
                <Axes x={[0, 100]} y={[0, 100]} box={[60, 20, 410, 290]} labels={[t`expected percentile`, t`found`]} />
                <path d={`M${at(0, 0)}L${at(100, 100)}`} stroke="currentColor" stroke-dasharray="4 3" stroke-opacity=".6" />
                {sorted.map((c, k) => <path d={`M${c.found.map(([x, y]) => at(x, y)).join('L')}`} fill="none" stroke={GROUPS[k]} stroke-width="2" stroke-dasharray={['', '7 3', '2 3'][k]} />)}
                {sorted.map((c, k) => <g transform={`translate(${62 + 120 * k} 342)`}><path d="M0 -4H22" stroke={GROUPS[k]} stroke-width="2" stroke-dasharray={['', '7 3', '2 3'][k]} /><text x="27" font-size="11" fill="currentColor">{c.name}</text></g>)}
                <text x="235" y="360" font-size="11" text-anchor="middle" fill="currentColor">{t`shaded: where 95 % of right ones stay`}</text>
            </svg>
        </Chart>
    );
}

const CHECKS = ['overall', 'mahalanobis', 'residual'];

/** What the calibration of a score has of each kind of check. */
export const checksOf = (calibration: any) => CHECKS.filter((name) => calibration?.[name]?.percentiles?.length > 1).map((name) => ({ name, ...calibration[name] }));
