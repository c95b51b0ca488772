; a need of a derived predicate under forall; derived on derived
(define (domain museum)
  (:requirements :adl :derived-predicates)
  (:types room guard exhibit)
  (:predicates (in ?e - exhibit ?r - room) (stands ?g - guard ?r - room) (asleep ?g - guard)
               (watched ?r - room) (safe ?e - exhibit) (all-safe) (door ?a ?b - room) (opened))
  (:derived (watched ?r - room)
    (exists (?g - guard) (and (stands ?g ?r) (not (asleep ?g)))))
  (:derived (safe ?e - exhibit)
    (exists (?r - room) (and (in ?e ?r) (watched ?r))))
  (:derived (all-safe) (forall (?e - exhibit) (safe ?e)))
  (:action walk
    :parameters (?g - guard ?a ?b - room)
    :precondition (and (stands ?g ?a) (not (asleep ?g)) (or (door ?a ?b) (door ?b ?a)))
    :effect (and (stands ?g ?b) (not (stands ?g ?a))))
  (:action wake
    :parameters (?g ?by - guard ?r - room)
    :precondition (and (stands ?g ?r) (stands ?by ?r) (asleep ?g) (not (asleep ?by)))
    :effect (not (asleep ?g)))
  (:action open-museum
    :precondition (all-safe)
    :effect (opened)))
