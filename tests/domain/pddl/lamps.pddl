; with annotations: lit is a value of an attribute, inside says where a thing is
(define (domain lamps)
  (:requirements :strips :typing :negative-preconditions)
  (:types room thing - object
          lamp - thing)
  (:predicates (lit ?l - lamp) (whole ?t - thing) (cracked ?t - thing)
               (stands-in ?t - thing ?r - room) (held ?t - thing) (free-hand))
  (:action switch-on
    :parameters (?l - lamp ?r - room)
    :precondition (and (stands-in ?l ?r) (not (lit ?l)) (whole ?l))
    :effect (lit ?l))
  (:action switch-off
    :parameters (?l - lamp)
    :precondition (lit ?l)
    :effect (not (lit ?l)))
  (:action lift
    :parameters (?t - thing ?r - room)
    :precondition (and (stands-in ?t ?r) (free-hand))
    :effect (and (held ?t) (not (stands-in ?t ?r)) (not (free-hand))))
  (:action mend
    :parameters (?t - thing)
    :precondition (and (held ?t) (cracked ?t))
    :effect (and (whole ?t) (not (cracked ?t))))
  (:action set-in
    :parameters (?t - thing ?r - room)
    :precondition (held ?t)
    :effect (and (stands-in ?t ?r) (free-hand) (not (held ?t)))))
