#!/usr/bin/env python3
"""Drives both nodes in real time while hostile messages come at 50 Hz, and every two minutes an attack that no filter can
pass over; scripts/soak --attack runs it. Private parameters: seconds; figures, a file for lines "what | beacon_mcl |
fastslam". Ends with 1, and says why, if a node ends, grows, falls silent, or is still wrong 30 s after an attack."""

import math
import sys
import threading
import time

import rospy
from hostile_messages import (NODES, Hostile, begin_drive, clock_a_day_ahead, false_landmarks, false_lengths, far_odometry,
                              forget_peak, large_scan, late_particles, late_pose, many_beacons, memory_of, other_beacons,
                              peak_of, process_of)
from pf_resampling.msg import FilterStatus

RATE = 50.0  # Hz, of what is hostile
PERIOD = 120.0  # s, from one attack to the next
RECOVERY = 30.0  # s
LOST = 1.0  # m
SILENT = 20  # messages of odometry in a row without a pose; some have to confirm each other after an attack
LATE = 3.0  # s from odometry to its pose, on a machine that has other things to do as well
ATTACKS = (other_beacons, many_beacons, late_pose, late_particles, far_odometry, large_scan, false_lengths,
           false_landmarks, clock_a_day_ahead)


class Attacker(threading.Thread):
    """Sends what is hostile, at its rate as far as the machine can."""

    def __init__(self, drive):
        super().__init__(daemon=True)
        self.hostile = Hostile(drive, 1)
        self.problem = None
        self.is_over = False

    def run(self):
        begin = time.monotonic()
        while not self.is_over:
            try:
                self.hostile.send()
            except (AssertionError, rospy.ServiceException, rospy.ROSException) as problem:
                self.problem = self.problem or str(problem)
            left = begin + self.hostile.sent / RATE - time.monotonic()
            if left > 0.0:
                time.sleep(left)


class Watch:
    """What a node was seen to do."""

    def __init__(self, name):
        self.name = name
        self.process = process_of(name)
        self.memory = []  # MiB
        # Its most since the one before: a checkpoint takes megabytes for a tenth of a second, which few samples meet.
        self.peaks = []
        self.measured = []  # when, by time.monotonic()
        self.rejected = 0
        self.subscriber = rospy.Subscriber('/' + name + '/status', FilterStatus, self.take)

    def take(self, status):
        self.rejected = sum(count.count for count in status.rejects)

    def measure(self):
        self.memory.append(memory_of(self.process))
        self.peaks.append(peak_of(self.process))
        self.measured.append(time.monotonic())
        forget_peak(self.process)


def drive_for(seconds, drive, watches):
    """In real time, whatever attacks take."""
    next_attack = time.monotonic() + 10.0
    end = time.monotonic() + seconds
    begin_step, begin_time = drive.step, time.monotonic()
    attacks = []
    drive.pause = 0.0
    while time.monotonic() < end:
        now = time.monotonic()
        if now > next_attack and end - now > RECOVERY + 10.0:
            attack = ATTACKS[len(attacks) % len(ATTACKS)]
            drive.pause = 0.1
            attack(drive)
            drive.pause = 0.0
            attacks.append((time.monotonic(), attack.__name__))
            next_attack += PERIOD
            begin_step, begin_time = drive.step, time.monotonic()
        drive.go_on(0.1)
        if drive.step % 10 == 0:
            for watch in watches:
                watch.measure()
        left = begin_time + 0.1 * (drive.step - begin_step) - time.monotonic()
        if left > 0.0:
            time.sleep(left)
    return attacks


def mean(values):
    return sum(values) / len(values)


def longest_run(flags):
    longest = run = 0
    for flag in flags:
        run = run + 1 if flag else 0
        longest = max(longest, run)
    return longest


def figures_of(watch, drive, begin, attacks):
    """[(what, how much)], [what is wrong]."""
    heard = [entry for entry in drive.heard[watch.name] if entry[0] >= begin]
    errors = sorted(error for _, error in heard)
    poses = drive.poses[watch.name]
    sent = {stamp: at for stamp, at in drive.sent.items() if at >= begin}
    missing = longest_run(stamp not in poses for stamp in sent)
    delays = sorted(poses[stamp][1] - at for stamp, at in sent.items() if stamp in poses)
    # After an attack, until the next: is it good again?
    late = [0.0]
    for number, (at, _) in enumerate(attacks):
        until = attacks[number + 1][0] - 5.0 if number + 1 < len(attacks) else math.inf
        late += [error for when, error in heard if at + RECOVERY <= when < until]
    warm = len(watch.memory) // 6
    middle = (warm + len(watch.memory)) // 2
    first, second = watch.memory[warm:middle], watch.memory[middle:]
    first_most, second_most = max(watch.peaks[warm:middle]), max(watch.peaks[middle:])
    most_at = watch.measured[watch.peaks.index(max(watch.peaks))]
    last_attack = next(((at, name) for at, name in reversed(attacks) if at <= most_at), (begin, 'the start'))
    sixths = [round(mean(watch.memory[i * len(watch.memory) // 6:(i + 1) * len(watch.memory) // 6])) for i in range(6)]
    wrong = []
    if not all(math.isfinite(error) for error in errors):
        wrong.append('a pose is not finite')
    if len(delays) < 0.97 * len(sent):
        wrong.append('{} poses for {} messages of odometry'.format(len(delays), len(sent)))
    if missing > SILENT:
        wrong.append('no pose for {} messages of odometry in a row'.format(missing))
    if delays[-1] > LATE:
        wrong.append('a pose came {:.1f} s after its odometry'.format(delays[-1]))
    if max(late) > LOST:
        wrong.append('{:.2f} m off, more than {:.0f} s after an attack'.format(max(late), RECOVERY))
    if second_most > 1.05 * first_most + 4.0 or mean(second) > 1.05 * mean(first) + 4.0:
        wrong.append('its memory grows')
    if watch.rejected == 0:
        wrong.append('nothing was rejected')
    return [
        ('messages of odometry that were good; poses of these', '{}; {}'.format(len(sent), len(delays))),
        ('most of these in a row without a pose', str(missing)),
        ('from odometry to its pose: median; 99 %; longest', '{:.3f}; {:.3f}; {:.3f} s'.format(
            delays[len(delays) // 2], delays[len(delays) * 99 // 100], delays[-1])),
        ('rejected', str(watch.rejected)),
        ('error of the pose: median; 95 %; largest', '{:.2f}; {:.2f}; {:.2f} m'.format(
            errors[len(errors) // 2], errors[len(errors) * 95 // 100], errors[-1])),
        ('the largest later than 30 s after an attack', '{:.2f} m'.format(max(late))),
        ('memory, mean of each sixth of the time', ', '.join(map(str, sixths)) + ' MiB'),
        ('without the first sixth, first half: mean; most', '{:.1f}; {} MiB'.format(mean(first), first_most)),
        ('second half: mean; most', '{:.1f}; {} MiB'.format(mean(second), second_most)),
        ('the most came', '{:.0f} s after {}'.format(most_at - last_attack[0], last_attack[1].replace('_', ' '))),
    ], wrong


def main():
    rospy.init_node('check_soak_attacked')
    seconds = float(rospy.get_param('~seconds'))
    drive = begin_drive()
    watches = [Watch(name) for name in NODES]
    attacker = Attacker(drive)
    begin = time.monotonic()
    attacker.start()
    attacks = drive_for(seconds, drive, watches)
    attacker.is_over = True
    attacker.join()
    duration = time.monotonic() - begin
    time.sleep(2.0)
    results = [figures_of(watch, drive, begin, attacks) for watch in watches]
    wrong = [watch.name + ': ' + what for watch, result in zip(watches, results) for what in result[1]]
    if attacker.problem:
        wrong.append(attacker.problem)
    sent = attacker.hostile.sent
    if sent < 0.8 * RATE * duration:
        wrong.append('only {} hostile messages in {:.0f} s'.format(sent, duration))
    with open(rospy.get_param('~figures'), 'w', encoding='utf-8') as file:
        file.write('time driven | {0:.0f} s | {0:.0f} s\n'.format(duration))
        file.write('hostile messages and requests, together | {0}; {1:.1f} Hz | {0}; {1:.1f} Hz\n'.format(sent, sent / duration))
        file.write('attacks that no filter can pass over | {0} | {0}\n'.format(len(attacks)))
        for left, right in zip(results[0][0], results[1][0]):
            file.write('{} | {} | {}\n'.format(left[0], left[1], right[1]))
    print('\n'.join(wrong))
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
