// Tables as people have them: CSV with commas or semicolons, or what a spreadsheet copies (tabs).
import { t } from './i18n';

export interface Table { columns: string[]; rows: string[][] }

/** Cells of all lines; quotes as in RFC 4180. */
function cells(text: string, separator: string): string[][] {
    const rows: string[][] = [];
    let row: string[] = [];
    let cell = '';
    let quoted = false;
    let opened = 0; // where the last quote began
    for (let i = 0; i < text.length; i++) {
        const c = text[i];
        if (quoted) {
            if (c !== '"') cell += c;
            else if (text[i + 1] === '"') cell += text[++i];
            else quoted = false;
        } else if (c === '"' && cell === '') {
            quoted = true;
            opened = i;
        }
        else if (c === separator || c === '\n') {
            row.push(cell.trim());
            cell = '';
            if (c === '\n') {
                rows.push(row);
                row = [];
            }
        } else cell += c;
    }
    if (quoted) throw new Error(t`The quote that begins in line ${text.slice(0, opened).split('\n').length} is not closed.`);
    if (cell || row.length) rows.push([...row, cell.trim()]);
    return rows.filter((r) => r.some((c) => c !== ''));
}

/** Fails with a sentence where a quote is not closed. Between semicolons and tabs a comma is that of a number, as spreadsheets of some countries write it. */
export function parseTable(text: string): Table {
    const clean = text.replace(/^\uFEFF/, '').replace(/\r\n?/g, '\n');
    const head = clean.slice(0, clean.indexOf('\n') < 0 ? undefined : clean.indexOf('\n'));
    const count = (c: string) => head.split(c).length;
    const separator = ['\t', ';', ','].reduce((best, c) => (count(c) > count(best) ? c : best), '\t');
    const [columns = [], ...rows] = cells(clean, separator);
    const numbered = separator === ',' ? rows
        : rows.map((r) => r.map((c) => (/^-?\d+,\d+$/.test(c) ? c.replace(',', '.') : c)));
    return { columns, rows: numbered.map((r) => columns.map((_, i) => r[i] ?? '')) };
}
