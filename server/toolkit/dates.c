/*
 * dates.c - see dates.h.
 */
#include "toolkit/dates.h"

#include <math.h>

#include "api/warnings.h"

#define YEAR_FIRST 1900
#define YEAR_LAST 2100

static int days_of(int year, int month)
{
    static const int days[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    bool leap = (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;

    return days[month - 1] + (month == 2 && leap);
}

static bool is_month(int number)
{
    int year = number / 100, month = number % 100;

    return year >= YEAR_FIRST && year <= YEAR_LAST && month >= 1 && month <= 12;
}

static bool is_day(int number)
{
    int month = number / 100, day = number % 100;

    return is_month(month) && day >= 1 && day <= days_of(month / 100, month % 100);
}

static bool is_date(double value, bool day)
{
    if (!(value >= YEAR_FIRST * 100.0 && value < (YEAR_LAST + 1) * 1e4) || floor(value) < value) {
        return false;
    }
    return day ? is_day((int)value) : is_month((int)value);
}

static bool all_dates(size_t n, const double *values, bool day)
{
    size_t count = 0;

    while (count < n && is_date(values[count], day)) {
        count++;
    }
    return n > 0 && count == n;
}

bool dates_warn(const char *name, size_t n, const double *values, json_t *warnings)
{
    bool days = all_dates(n, values, true);
    double first, last;

    if (!days && !all_dates(n, values, false)) {
        return false;
    }
    first = last = values[0];
    for (size_t i = 1; i < n; i++) {
        first = fmin(first, values[i]);
        last = fmax(last, values[i]);
    }
    if (!(last > first)) {
        return false;
    }
    warning_add(warnings, "covariate-is-date",
                json_pack("{s:s, s:s, s:I, s:I, s:I}", "covariate", name, "format",
                          days ? "YYYYMMDD" : "YYYYMM", "first", (json_int_t)first, "last",
                          (json_int_t)last, "members", (json_int_t)n),
                "%.60s looks like dates, %s: from %.0f to %.0f in all %zu members. It counts as a "
                "number, and differences of such numbers are no durations: from one %s to the "
                "next they jump. Give years with their fraction, or days since a date.",
                name, days ? "YYYYMMDD" : "YYYYMM", first, last, n, days ? "month" : "year");
    return true;
}
