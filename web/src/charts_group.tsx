// Charts of a group: how far each member is from the mean, landmarks of all members, and what each structure says alone.
import { Chart, DataTable, Intervals, Scatter } from './charts';
import { t } from './i18n';
import { figure } from './text';

// ---- Distances from the mean ---------------------------------------------------------------------------------------

const PRESSED_MAX = 400; // marks that can have the focus

export const hasDistances = (result: any): boolean => Array.isArray(result.labels) && Array.isArray(result.distances)
    && result.distances.length === result.labels.length && result.distances.every((d: unknown) => typeof d === 'number');

/** How far each member is from the mean, the nearest first. */
export function MemberDistances({ result, chosen, onChoose }: { result: any; chosen?: number; onChoose?: (i: number) => void }) {
    const order: number[] = result.distances.map((_: unknown, i: number) => i).sort((a: number, b: number) => result.distances[a] - result.distances[b]);
    const dots = order.map((i, rank) => ({ x: rank + 1, y: result.distances[i], name: result.labels[i], group: result.groups?.[i] }));
    return <Scatter title={t`How far each member is from the mean`} name="members" dots={dots} labels={[t`members, in this order`, t`distance from the mean`]}
        chosen={chosen === undefined ? undefined : order.indexOf(chosen)} onChoose={onChoose && dots.length <= PRESSED_MAX ? (rank) => onChoose(order[rank]) : undefined} />;
}

// ---- Landmarks of a group ------------------------------------------------------------------------------------------

interface GroupPoint { position: number[]; heldOut: boolean; maxAngle: number | null; rmsAngle: number | null; maxDistance: number | null; rmsDistance: number | null }

export const areOfGroup = (landmarks: any): boolean => Array.isArray(landmarks?.points) && Array.isArray(landmarks.members);

/** What is left is rounding: the landmark was met exactly. */
export const isMet = (angle: number | null): boolean => angle !== null && angle < 1e-9;

/** What the registrations leave at each landmark: the root mean square over the members, and the most. */
export function GroupLandmarks({ points }: { points: GroupPoint[] }) {
    const most = Math.max(...points.map((p) => p.maxDistance ?? 0)) || 1e-12;
    const height = 46 + 20 * points.length;
    const at = (v: number | null) => 130 + (270 * (v ?? 0)) / most;
    return (
        <Chart title={t`Distance that is left at each landmark`} name="landmarks" rows={[[t`landmark`, t`held out`, t`root mean square`, t`most`, t`angle, root mean square`, t`angle, most`],
            ...points.map((p, i) => [i + 1, p.heldOut ? t`yes` : t`no`, p.rmsDistance, p.maxDistance, p.rmsAngle, p.maxAngle])]}>
            <svg viewBox={`0 0 420 ${height}`} role="img" aria-label={points.map((p, i) => t`landmark ${i + 1}${p.heldOut ? t`, held out` : ''}: ${figure(p.rmsDistance)}, at most ${figure(p.maxDistance)}`).join('; ')}>
                {points.map((p, i) => {
                    const colour = p.heldOut ? '#d55e00' : '#0072b2';
                    return (
                        <g transform={`translate(0 ${16 + 20 * i})`}>
                            <text x="120" y="4" font-size="11" text-anchor="end" fill="currentColor">{t`landmark ${i + 1}`}</text>
                            <path d={`M130 0H${at(p.maxDistance)}M${at(p.maxDistance)} -5V5`} stroke={colour} stroke-width="2" fill="none" />
                            <circle cx={at(p.rmsDistance)} cy="0" r="5" fill={p.heldOut ? 'none' : colour} stroke={p.heldOut ? colour : 'none'} stroke-width="2" />
                        </g>
                    );
                })}
                <text x="130" y={height - 20} font-size="11" fill="currentColor">0</text>
                <text x="400" y={height - 20} font-size="11" text-anchor="end" fill="currentColor">{figure(most)}</text>
                <text x="265" y={height - 6} font-size="11" text-anchor="middle" fill="currentColor">{t`circle: over the members; end: at most; rings: held out`}</text>
            </svg>
        </Chart>
    );
}

/** What is left at landmarks, in words. */
export const leftAt = (of: any): string => (isMet(of.maxAngle) ? t`all of them met exactly` : t`${figure(of.rmsDistance)} in the mean (root of squares), ${figure(of.maxDistance)} at most`);

// ---- What a classifier is worth --------------------------------------------------------------------------------------

/** Shares that a classifier gets right, of all, of each class and of pairs, with their intervals. */
export function Rates({ of, chance, title, name }: { of: any; chance: number; title: string; name: string }) {
    const byClass = (rates: any, text: (c: string) => string): [string, any][] => Object.entries<any>(rates ?? {}).map(([c, rate]) => [text(c), rate]);
    const accuracy = typeof of.accuracy === 'number' ? { value: of.accuracy, interval: of.confidenceInterval } : of.accuracy;
    const rates: [string, any][] = [[t`accuracy`, accuracy], [t`balanced accuracy`, of.balancedAccuracy], ...byClass(of.sensitivity, (c) => t`${c} that are told`), ...byClass(of.auc, (c) => t`AUC of ${c}`)];
    const rows = rates.filter(([, rate]) => typeof rate?.value === 'number' && typeof rate.interval?.[0] === 'number')
        .map(([what, rate]) => ({ name: what, value: rate.value, low: rate.interval[0], high: rate.interval[1] }));
    return rows.length > 0 ? <Intervals title={title} name={name} heading="rate" chance={chance} rows={rows} /> : null;
}

/** How far probabilities are from what was so, with intervals, beside those of always saying the priors. */
export function ProbabilityScores({ of }: { of: any }) {
    const rows = [[t`Brier score`, of.brier, of.brierInterval, of.brierReference], [t`log loss`, of.logLoss, of.logLossInterval, of.logLossReference]]
        .filter(([, value]) => typeof value === 'number');
    return rows.length > 0 ? (
        <DataTable rows={[[t`score of the probabilities (0: always right)`, t`value`, t`95 % from`, t`to`, t`of the priors alone`],
            ...rows.map(([what, value, interval, reference]) => [what, value, interval?.[0] ?? null, interval?.[1] ?? null, reference])]} />
    ) : null;
}

// ---- What each structure says alone --------------------------------------------------------------------------------

export const hasParts = (result: any): boolean => !!result.methods && Array.isArray(result.parts) && !!result.parts[0]?.methods;

/** Accuracy of all structures together, and of each alone. */
export function PartIntervals({ result, method }: { result: any; method: string }) {
    const row = (name: string, m: any) => ({ name, value: m.accuracy, low: m.confidenceInterval[0], high: m.confidenceInterval[1], p: m.pValue });
    const parts = result.parts.filter((p: any) => p.methods[method]);
    const short = (name: string) => (name.length > 17 ? `${name.slice(0, 16)}…` : name);
    return <Intervals title={t`${method}: all structures together, and each alone`} name={`structures-${method}`} heading="structure" chance={Math.max(result.chance, result.majorityRate)}
        rows={[row(t`all together`, result.methods[method]), ...parts.map((p: any) => row(short(p.name), p.methods[method]))]} />;
}
