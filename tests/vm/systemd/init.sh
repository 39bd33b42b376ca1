#!/bin/busybox sh
# From the kernel's hands to systemd's: modules, the disk, and upon it what is injected.
b=/bin/busybox
$b mkdir -p /dev /proc /sys /disk
$b mount -t devtmpfs dev /dev
$b mount -t proc proc /proc
$b mount -t sysfs sys /sys
for module in /modules/*; do
    $b insmod "$module" || echo "cannot load $module"
done
tries=0
while [ ! -b /dev/vda ] && [ $tries -lt 100 ]; do
    $b sleep 0.1
    tries=$((tries + 1))
done
$b mount -t ext4 /dev/vda /disk && $b cp -a /inject/. /disk/ || echo "there is no disk"
$b chmod 644 /disk/etc/systemd/system/relief-vm.service /disk/etc/machine-id
$b chroot /disk /sbin/depmod || echo "the disk's modules are not found"
for place in dev proc sys; do
    $b mount -o move /$place /disk/$place
done
exec $b switch_root /disk /lib/systemd/systemd
