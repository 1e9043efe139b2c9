// Charts of what differs within subjects: amounts with their intervals, and what each subject does.
import { Chart, ticks } from './charts';
import { t } from './i18n';
import { figure } from './text';

const LEFT = 150;
const RIGHT = 400;

/** Lengths on one axis from 0 on, with 95 % intervals. */
export function Amounts({ title, name, unit, rows }: { title: string; name: string; unit: string; rows: { name: string; value: number; low: number | null; high: number | null }[] }) {
    const most = 1.04 * Math.max(...rows.map((r) => r.high ?? r.value)) || 1;
    const height = 52 + 30 * rows.length;
    const at = (v: number) => LEFT + ((RIGHT - LEFT) * Math.max(0, v)) / most;
    return (
        <Chart title={title} name={name} rows={[[t`what`, unit, t`low`, t`high`], ...rows.map((r) => [r.name, r.value, r.low, r.high])]}>
            <svg viewBox={`0 0 420 ${height}`} role="img" aria-label={rows.map((r) => t`${r.name}: ${figure(r.value)}, ${figure(r.low)} to ${figure(r.high)} ${unit}`).join('; ')}>
                {ticks(0, most).map((v) => <><path d={`M${at(v)} 10V${height - 40}`} stroke="currentColor" stroke-opacity=".15" /><text x={at(v)} y={height - 24} font-size="11" text-anchor="middle" fill="currentColor">{figure(v)}</text></>)}
                <text x={(LEFT + RIGHT) / 2} y={height - 6} font-size="11" text-anchor="middle" fill="currentColor">{unit}</text>
                {rows.map((r, i) => (
                    <g transform={`translate(0 ${25 + 30 * i})`}>
                        <text x="8" y="4" font-size="12" fill="currentColor">{r.name}</text>
                        {r.low !== null && r.high !== null && <path d={`M${at(r.low)} 0H${at(r.high)}M${at(r.low)} -5V5M${at(r.high)} -5V5`} stroke="currentColor" fill="none" />}
                        <circle cx={at(r.value)} cy="0" r="5" fill="#0072b2" />
                    </g>
                ))}
            </svg>
        </Chart>
    );
}

export interface Subject { name: string; along: number; length: number }

const ROWS_MAX = 60;
const shortened = (text: string): string => (text.length > 20 ? `${text.slice(0, 19)}…` : text);

/** A line for each subject, sorted: how far it goes along the mean of all (bar), and how far in all (ring). */
export function Subjects({ title, unit, subjects, chosen, onChoose }: {
    title: string; unit: string; subjects: Subject[]; chosen?: number; onChoose?: (i: number) => void;
}) {
    const order = subjects.map((_, i) => i).sort((a, b) => subjects[b].along - subjects[a].along);
    const few = subjects.length <= ROWS_MAX;
    const line = few ? 18 : Math.max(3, (18 * ROWS_MAX) / subjects.length);
    const low = Math.min(0, ...subjects.map((s) => s.along));
    const high = Math.max(...subjects.flatMap((s) => [s.along, s.length]), low + 1e-12);
    const at = (v: number) => LEFT + ((RIGHT - LEFT) * (v - low)) / (high - low);
    const bottom = 16 + line * subjects.length;
    const against = subjects.filter((s) => s.along < 0).length;
    const said = (s: Subject) => t`${s.name}: ${figure(s.along)} along the mean, ${figure(s.length)} in all, ${unit}`;
    const press = (i: number) => ({
        tabindex: 0, role: 'button' as const, class: 'dot', 'aria-pressed': chosen === i, 'aria-label': said(subjects[i]), onClick: () => onChoose!(i),
        onKeyDown: (e: KeyboardEvent) => { if (e.key === 'Enter' || e.key === ' ') { onChoose!(i); e.preventDefault(); } },
    });
    return (
        <Chart title={title} name="subjects" rows={[[t`subject`, t`along the mean`, t`length`], ...subjects.map((s) => [s.name, s.along, s.length])]}>
            <svg viewBox={`0 0 420 ${bottom + 52}`} role="group" aria-label={t`${title}: ${subjects.length} subjects, ${against} against the mean${onChoose ? t`; Enter on one shows it` : ''}`}>
                {ticks(low, high).map((v) => <><path d={`M${at(v)} 10V${bottom}`} stroke="currentColor" stroke-opacity={v === 0 ? 0.6 : 0.15} /><text x={at(v)} y={bottom + 15} font-size="11" text-anchor="middle" fill="currentColor">{figure(v)}</text></>)}
                {few && order.map((i, row) => <text x={LEFT - 12} y={20 + line * (row + 0.5)} font-size="11" text-anchor="end" fill="currentColor">{shortened(subjects[i].name)}</text>)}
                {order.map((i, row) => {
                    const s = subjects[i];
                    const colour = s.along < 0 ? '#d55e00' : '#0072b2';
                    return (
                        <g key={i} transform={`translate(0 ${16 + line * (row + 0.5)})`} {...(onChoose ? press(i) : {})}>
                            <title>{said(s)}</title>
                            <rect x="4" y={-line / 2} width="412" height={line} fill={chosen === i ? 'currentColor' : 'transparent'} fill-opacity=".15" />
                            <path d={`M${at(0)} 0H${at(s.along)}`} stroke={colour} stroke-width={Math.min(5, line / 2)} />
                            <circle cx={at(s.length)} cy="0" r={Math.min(4, line / 2)} fill="none" stroke="currentColor" />
                        </g>
                    );
                })}
                <text x={(LEFT + RIGHT) / 2} y={bottom + 31} font-size="11" text-anchor="middle" fill="currentColor">{unit}</text>
                <text x={(LEFT + RIGHT) / 2} y={bottom + 46} font-size="11" text-anchor="middle" fill="currentColor">{t`bar: along the mean of all; ring: in all`}</text>
            </svg>
        </Chart>
    );
}
