/*
 * notify.h - telling the service manager: ready, stopping, alive (the protocol of sd_notify).
 * Without NOTIFY_SOCKET in the environment nothing is told.
 */
#ifndef SRNFD_NOTIFY_H
#define SRNFD_NOTIFY_H

/* Sends "READY=1", "STOPPING=1", "WATCHDOG=1" or other lines of the protocol. */
void notify_manager(const char *state);

/* Seconds between two signs of life that the manager asks for, or 0. */
double notify_watchdog_seconds(void);

#endif
