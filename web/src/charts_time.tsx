// Charts of slopes: a line for each subject, and how each is beside the others.
import { Axes, Chart, Legend, LEGEND_COLUMNS, Scatter, padded } from './charts';
import { Amounts, Subjects } from './charts_within';
import { groupLook } from './colours';
import { t } from './i18n';
import { figure } from './text';

export interface Line { name: string; group?: string | null; from: [number, number]; to: [number, number] }

/** Straight lines, of which one can be chosen; the mean of all is dashed. */
export function Lines({ title, name, labels, lines, mean, chosen, onChoose }: {
    title: string; name: string; labels: [string, string]; lines: Line[]; mean?: Line; chosen?: number; onChoose?: (i: number) => void;
}) {
    const groups = [...new Set(lines.map((l) => l.group).filter((g): g is string => !!g))];
    const ends = [...lines, ...(mean ? [mean] : [])].flatMap((l) => [l.from, l.to]);
    const x = padded(ends.map((p) => p[0]));
    const y = padded(ends.map((p) => p[1]));
    const at = ([a, b]: [number, number]) => `${(60 + ((a - x[0]) / (x[1] - x[0])) * 350).toFixed(1)} ${(290 - ((b - y[0]) / (y[1] - y[0])) * 270).toFixed(1)}`;
    const said = (l: Line) => t`${l.name}${l.group ? `, ${l.group}` : ''}: ${figure(l.to[1])} from ${figure(l.from[0])} to ${figure(l.to[0])}`;
    const press = (i: number) => ({
        tabindex: 0, role: 'button' as const, class: 'dot', 'aria-pressed': chosen === i, 'aria-label': said(lines[i]), onClick: () => onChoose!(i),
        onKeyDown: (e: KeyboardEvent) => { if (e.key === 'Enter' || e.key === ' ') { onChoose!(i); e.preventDefault(); } },
    });
    return (
        <Chart title={title} name={name} rows={[[t`name`, t`group`, t`${labels[0]}, first`, t`${labels[0]}, last`, labels[1]], ...lines.map((l) => [l.name, l.group ?? '', l.from[0], l.to[0], l.to[1]])]}>
            <svg viewBox={`0 0 420 ${groups.length > LEGEND_COLUMNS ? 366 : 350}`} role="group" aria-label={t`${title}: ${lines.length} lines${onChoose ? t`; Enter on one shows its shapes` : ''}`}>
                <Axes x={x} y={y} box={[60, 20, 410, 290]} labels={labels} />
                {lines.map((l, i) => {
                    const { colour, path } = groupLook(groups, l.group);
                    return (
                        <g key={i} {...(onChoose ? press(i) : {})}>
                            <title>{said(l)}</title>
                            <path d={`M${at(l.from)}L${at(l.to)}`} stroke="transparent" stroke-width="9" />
                            <path d={`M${at(l.from)}L${at(l.to)}`} stroke={colour} stroke-width={chosen === i ? 4 : 1.6} stroke-opacity={chosen === undefined || chosen === i ? 1 : 0.5} />
                            <path transform={`translate(${at(l.to)}) scale(.7)`} d={path} fill={colour} />
                        </g>
                    );
                })}
                {mean && <path d={`M${at(mean.from)}L${at(mean.to)}`} stroke="currentColor" stroke-width="2" stroke-dasharray="6 4"><title>{said(mean)}</title></path>}
                <Legend groups={groups} />
            </svg>
        </Chart>
    );
}

/** Labels of subjects, where the visits of each agree on one. */
function labelsOf(cohort: any): Map<string, string> {
    const labels = new Map<string, string>();
    (cohort?.subjects ?? []).forEach((subject: string, i: number) => {
        const label = cohort.labels?.[i];
        if (label && !labels.has(subject)) labels.set(subject, label);
    });
    return labels;
}

export const isTrajectories = (result: any): boolean => !!result.slope?.rate && Array.isArray(result.perSubject);

export function TrajectoryCharts({ result, chosen, onChoose }: { result: any; chosen?: number; onChoose?: (i: number) => void }) {
    const labels = labelsOf(result.inputs?.cohort);
    const subjects: any[] = result.perSubject.filter((s: any) => typeof s.along === 'number');
    const place = (i: number) => result.perSubject.indexOf(subjects[i]);
    const own = onChoose && ((i: number) => onChoose(place(i)));
    const marked = chosen === undefined ? undefined : subjects.indexOf(result.perSubject[chosen]);
    const first = Math.min(...subjects.map((s) => s.times[0]));
    const last = Math.max(...subjects.map((s) => s.times[1]));
    const lines = subjects.map((s): Line => ({ name: s.subject, group: labels.get(s.subject), from: [s.times[0], 0], to: [s.times[1], s.along * (s.times[1] - s.times[0])] }));
    const { rate, variation } = result.slope;
    const amounts = [[t`mean slope`, rate], [t`variation of slopes`, variation]].filter(([, e]: any) => typeof e?.value === 'number')
        .map(([name, e]: any) => ({ name, value: e.value, low: e.interval[0], high: e.interval[1] }));
    const known = subjects.every((s) => typeof s.speed === 'number' && typeof s.oddness === 'number');
    return (
        <>
            <Lines title={t`Each subject, along what the others predict, since its first visit`} name="lines" labels={[t`time`, t`mm`]} lines={lines} chosen={marked} onChoose={own}
                mean={{ name: 'mean of all', from: [first, 0], to: [last, rate.value * (last - first)] }} />
            {known && <Scatter title={t`Beside the others: how fast, and how unlike them`} name="subjects-beside" labels={[t`speed (1: as fast as the others)`, t`unlike them (sd)`]} chosen={marked} onChoose={own}
                dots={subjects.map((s) => ({ x: s.speed, y: s.oddness, name: s.subject, group: labels.get(s.subject) }))} />}
            <Amounts title={t`Slopes, with 95 % intervals`} name="slopes" unit="mm per unit of time" rows={amounts} />
            <Subjects title={t`Slope of each subject`} unit="mm per unit of time" chosen={marked} onChoose={own}
                subjects={subjects.map((s) => ({ name: s.subject, along: s.along, length: s.length ?? 0 }))} />
        </>
    );
}
