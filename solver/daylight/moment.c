#include "solver/daylight/moment.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

static const char *const months[12] = {"January", "February", "March",     "April",   "May",      "June",
                                       "July",    "August",   "September", "October", "November", "December"};
static const int days[12] = {31, 29, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};

/* 1 to 12, or 0. */
static int month_of(const char *word) {
    const size_t length = strlen(word);
    for (int k = 0; length >= 3 && k < 12; k++)
        if (strncasecmp(word, months[k], length) == 0) return k + 1;
    return 0;
}

lam_status moment_parse(const char *what, const char *text, moment *out, lam_error *error) {
    int day = 0, hour = 0, minute = 0, end = 0;
    char word[12] = "";
    const bool plain =
        strspn(text, "0123456789 :abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ") == strlen(text);
    const bool read = plain &&
                      sscanf(text, " %2d %10[a-zA-Z] %2d:%2d %n", &day, word, &hour, &minute, &end) == 4 &&
                      text[end] == '\0';
    const int month = read ? month_of(word) : 0;
    if (month == 0 || day < 1 || day > days[month - 1] || hour > 23 || minute > 59)
        return status_fail(error, LAM_ERR_ARGUMENT, "%s %.60s: must be DAY MONTH HH:MM, as 21 Mar 12:00",
                           what, text);
    *out = (moment){.month = month, .day = day, .hour = hour + minute / 60.};
    return LAM_OK;
}

moment moment_of_hour(double hours) {
    moment m = {.month = 1, .day = 1 + (int)(hours / 24), .hour = fmod(hours, 24)};
    for (int k = 0; k < 11; k++) {
        const int length = days[k] - (k == 1);
        if (m.day <= length) break;
        m.day -= length;
        m.month++;
    }
    return m;
}

void moment_name(const moment *m, char text[MOMENT_BYTES]) {
    const int minutes = (int)(60 * m->hour + 1e-6);
    snprintf(text, MOMENT_BYTES, "%d %.3s %02d:%02d", m->day, months[m->month - 1], minutes / 60,
             minutes % 60);
}

lam_status moment_find(const moment *m, const char *path, const weather *w, weather_hour *out,
                       lam_error *error) {
    char name[MOMENT_BYTES];
    for (size_t i = 0; i < w->n; i++) {
        const weather_hour *h = &w->hours[i];
        /* Decimals of hours are rounded. */
        const double from = h->hour - w->step / 2 - 1e-3, to = h->hour + w->step / 2 - 1e-3;
        if (h->month != m->month || h->day != m->day || m->hour < from || m->hour >= to) continue;
        *out = *h;
        return LAM_OK;
    }
    moment_name(m, name);
    return status_fail(error, LAM_ERR_ARGUMENT,
                       "%s: no row covers %s; it has %zu rows of %.4g h from %d/%d to %d/%d", path, name,
                       w->n, w->step, w->hours[0].month, w->hours[0].day, w->hours[w->n - 1].month,
                       w->hours[w->n - 1].day);
}

lam_status moment_pick(const moment *m, const char *path, weather *w, lam_error *error) {
    weather_hour found;
    const lam_status status = moment_find(m, path, w, &found, error);
    if (status != LAM_OK) return status;
    w->hours[0] = found;
    w->n = w->stretches = 1;
    return LAM_OK;
}
